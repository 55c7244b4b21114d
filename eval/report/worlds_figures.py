"""Figures of the comparison of worlds, as SVG text."""

from collections.abc import Mapping, Sequence

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from beacon_mj.eval.report.figures import FAINT, frame, svg
from beacon_mj.eval.report.single_pushes import (
    energy_ratios,
    groups,
    hits,
    middle,
)
from beacon_mj.eval.report.worlds import BASELINE
from beacon_mj.eval.statistics.intervals import Interval, wilson_interval
from beacon_mj.eval.studies.push_trials import Push

#: Of each planner and metric, the difference in each world.
Differences = Mapping[tuple[str, str], Mapping[str, Interval]]
#: Colour, marker and name of each world.
_LOOKS = {
    "mujoco": ("#000000", "o", "MuJoCo"),
    "paper": ("#0072B2", "s", "planar, paper"),
    "limit-surface": ("#D55E00", "^", "planar, limit-surface"),
}
_FAR = ("bug1", "bug2")  #: They touch nothing, and would stretch every axis.
_UNITS = {
    "success": "success [points]",
    "steps": "steps",
    "path m": "path [m]",
    "energy J": "energy [J]",
}


def difference_panels(found: Differences) -> str:
    """Return each planner less the baseline, a panel a metric."""
    planners = [*dict.fromkeys(name for name, _ in found if name not in _FAR)]
    figure, panels = _panels(len(_UNITS), planners, across=2)
    for axes, (metric, unit) in zip(panels, _UNITS.items(), strict=True):
        frame(axes, f"{unit}, less {BASELINE}'s", "")
        axes.axvline(0.0, color=FAINT, lw=1.5, zorder=0)
        for row, name in enumerate(planners):
            for world, each in found[name, metric].items():
                _span(axes, row, world, (each.estimate, each.low, each.high))
    return _finished(figure, panels[0])


def cascade_panels(pushes: Sequence[Push]) -> str:
    """Return precision and recall of predicted cascades by shape."""
    named = _by_shape(pushes)
    figure, panels = _panels(2, [_counted(name, own) for name, own in named])
    for side, (axes, label) in enumerate(
        zip(panels, ("precision [%]", "recall [%]"), strict=True)
    ):
        frame(axes, label, "")
        for row, (_, own) in enumerate(named):
            for world in own[0].trials:
                count, n = hits(own, world)[side]
                if n:
                    low, high = wilson_interval(count, n)
                    values = (100.0 * count / n, 100.0 * low, 100.0 * high)
                    _span(axes, row, world, values)
    return _finished(figure, panels[0])


def energy_panel(pushes: Sequence[Push]) -> str:
    """Return work over sum F d by shape: medians, and quartiles."""
    named = _by_shape(pushes)
    figure, [axes] = _panels(1, [_counted(name, own) for name, own in named])
    frame(axes, "work of the drives over sum F d", "")
    axes.axvline(1.0, color=FAINT, lw=1.5, zorder=0)
    for row, (_, own) in enumerate(named):
        for world in own[0].trials:
            if ratios := energy_ratios(own, world):
                _span(axes, row, world, middle(ratios))
    axes.set_xlim(left=0.0)
    return _finished(figure, axes)


def _by_shape(pushes: Sequence[Push]) -> list[tuple[str, list[Push]]]:
    """Return all pushes, and those of each shape."""
    names = {"all", *(p.shape for p in pushes)}
    return [(name, own) for name, own in groups(pushes) if name in names]


def _counted(name: str, own: Sequence[Push]) -> str:
    return f"{name} ({len(own)})"


def _panels(
    count: int, names: Sequence[str], across: int | None = None
) -> tuple[Figure, list[Axes]]:
    """Return a figure of panels, by default side by side, a line a name in each."""
    across = across or count
    down = count // across
    size = (2.4 * across + 1.4, 0.4 + (0.6 + 0.38 * len(names)) * down)
    with mpl.rc_context({"font.size": 9}):
        figure = Figure(size, layout="constrained")
        grid = figure.subplots(down, across, sharey=True, squeeze=False)
        panels = [*grid.ravel()]
    panels[0].set_yticks(range(len(names)), names)
    panels[0].set_ylim(len(names) - 0.5, -0.5)
    return figure, panels


def _span(axes: Axes, row: int, world: str, values: tuple[float, float, float]) -> None:
    """Draw a value and its interval on a line of its own within a row."""
    colour, marker, label = _LOOKS[world]
    centre, low, high = values
    y = row + 0.22 * ([*_LOOKS].index(world) - 1)
    if low == low:
        axes.plot([low, high], [y, y], color=colour, lw=1.4)
    axes.plot([centre], [y], marker, color=colour, ms=4.5, label=label)


def _finished(figure: Figure, axes: Axes) -> str:
    """Return the figure as SVG, its legend below."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    figure.legend(
        [*once.values()], [*once], loc="outside lower center", ncols=3, frameon=False,
        fontsize=8,
    )  # fmt: skip
    return svg(figure)
