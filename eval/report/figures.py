"""The figures of a report, as SVG text; equal numbers give equal text.

Colours are Okabe and Ito's, told apart by colour-blind readers, and every planner has
a marker and a dash of its own besides, for prints in grey.
"""

from collections.abc import Mapping, Sequence
from io import StringIO
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from beacon_mj.errors import printable
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.statistics.oracles import marked, oracles, oracles_of
from beacon_mj.eval.statistics.summary import OVERALL
from beacon_mj.eval.studies.calibration import Reliability

SIZE_IN = (4.6, 4.3)  #: Of one panel, legend included.
INK, FAINT = "#1a1a1a", "#d0d0d0"
_STYLES = (
    ("#0072B2", "o"),
    ("#D55E00", "s"),
    ("#009E73", "^"),
    ("#CC79A7", "D"),
    ("#E69F00", "v"),
    ("#56B4E9", "P"),
    ("#000000", "X"),
    ("#8C5A2B", "*"),
    ("#777777", "<"),
    ("#8B7500", ">"),
)
_DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))
#: Planners that keep their colour from report to report.
_KNOWN = (
    "beacon",
    "dstar-lite",
    "semantic",
    "bug1",
    "bug2",
    "beacon-voi",
    "push-through",
    "impact",
    "clairvoyant",
    "beacon-kinds",
)
#: Panels of the overview: their axes.
OVERVIEW = (
    "success (filled), clean (open) [%]",
    "mean steps, all episodes",
    "mean number of broken obstacles",
)
#: What the Pareto plots set against success: column, axis.
PARETO = (
    ("path_length_m", "mean path [m], all episodes"),
    ("energy_j", "mean energy [J], all episodes"),
    ("obstacles_broken", "mean number of broken obstacles, all episodes"),
)


def overview(summary: dict[str, Any], *, wide: bool) -> str:
    """Return what matters most of every planner: success, steps, and what broke.

    Args:
        summary: Tables of the run.
        wide: Whether the panels stand side by side, or below each other.
    """
    cells = {name: own[OVERALL] for name, own in summary["tables"].items()}
    names, told = [*cells], oracles_of(summary)
    height = 0.9 + 0.27 * len(names)
    across, down = (3, 1) if wide else (1, 3)
    with mpl.rc_context({"font.size": 9 if wide else 10}):
        size = (3.1 * across + 1.4, height * down)
        figure = Figure(size, layout="constrained")
        panels = figure.subplots(down, across, sharey=True, squeeze=False).ravel()
    rates = ("success", "clean_success")
    for axes, label in zip(panels, OVERVIEW, strict=True):
        frame(axes, label, "")
        axes.grid(axis="y", visible=False)
    for k, name in enumerate(names):
        colour, marker = style(name, names)
        own = cells[name]
        for rate, face in zip(rates, (colour, "white"), strict=True):
            found = {end: _times(100.0, own[rate][end]) for end in ("low", "high")}
            found["mean"] = _times(100.0, own[rate]["rate"])
            y = k - 0.13 if rate == "success" else k + 0.13
            _dot(panels[0], found, y, colour, marker, face)
        for axes, column in zip(panels[1:], ("steps", "obstacles_broken"), strict=True):
            _dot(axes, own["mean"][column], k, colour, marker, colour)
    panels[0].set_yticks(range(len(names)), [_label(name, told) for name in names])
    panels[0].set_ylim(len(names) - 0.5, -0.5)
    for axes in panels:
        axes.margins(x=0.06)
        not_below_zero(axes)
        axes.tick_params(labelleft=axes is panels[0] or not wide)
    return svg(figure)


def not_below_zero(axes: Axes) -> None:
    """Let the horizontal axis of what cannot be negative begin at 0, or above."""
    low, high = axes.get_xlim()
    if low < 0.0:
        widest = max(high, 1.0) if low == -high else high
        axes.set_xlim(-0.04 * widest, widest)


def _times(factor: float, value: float | None) -> float | None:
    return None if value is None else factor * value


def _dot(
    axes: Axes, found: Mapping[str, Any], y: float, colour: str, marker: str, face: str
) -> None:
    """Draw a value and its interval on a line of its own."""
    if found["mean"] is None:
        return
    if found["low"] is not None:
        axes.plot([found["low"], found["high"]], [y, y], color=colour, lw=1.2)
    axes.plot(
        [found["mean"]], [y], marker, color=colour, ms=6, mfc=face, mew=1.2,
    )  # fmt: skip


def pareto(summary: dict[str, Any], column: str, label: str) -> str:
    """Return success against a mean cost; a line joins what no planner beats in both.

    Args:
        summary: Tables of the run.
        column: The cost, smaller is better.
        label: Of its axis.
    """
    cells = {name: own[OVERALL] for name, own in summary["tables"].items()}
    told = oracles_of(summary)
    points = {
        name: (c["mean"][column]["mean"], 100.0 * c["success"]["rate"])
        for name, c in cells.items()
    }
    figure, axes = panel(label, "success [%]")
    front = sorted(p for p in points.values() if not _beaten(p, points.values()))
    axes.plot(*zip(*front, strict=True), color=FAINT, lw=3, zorder=1)
    for name, (x, y) in points.items():
        colour, marker = style(name, [*points])
        won, cost = cells[name]["success"], cells[name]["mean"][column]
        across = (
            None if cost["low"] is None else [[x - cost["low"]], [cost["high"] - x]]
        )
        up = [[y - 100.0 * won["low"]], [100.0 * won["high"] - y]]
        axes.errorbar(
            [x], [y], xerr=across, yerr=up, fmt=marker, color=colour, ms=7, lw=1,
            label=_label(name, told), mec="white", mew=0.5,
        )  # fmt: skip
    axes.margins(x=0.08, y=0.08)  # As far as differences reach, not from 0 to 100.
    not_below_zero(axes)
    legend(figure, axes)
    return svg(figure)


def reliability_diagram(curves: Mapping[str, Reliability]) -> str:
    """Return the share of right forecasts against confidence, a curve a set."""
    figure, axes = panel("confidence in the most probable class", "share that is right")
    axes.plot([0, 1], [0, 1], color=FAINT, lw=2, zorder=1)
    for k, (name, curve) in enumerate(curves.items()):
        colour, marker = _STYLES[k]
        x = [b.confidence for b in curve.bins]
        y = [b.correct for b in curve.bins]
        ends = [
            [max(b.correct - b.low, 0.0) for b in curve.bins],
            [max(b.high - b.correct, 0.0) for b in curve.bins],
        ]
        error = "" if curve.error is None else f", ECE {curve.error:.3f}"
        axes.errorbar(
            x, y, yerr=ends, color=colour, marker=marker, ms=5, lw=1.2,
            ls=_DASHES[k], label=f"{name}: n = {curve.n}{error}",
        )  # fmt: skip
    axes.set(xlim=(0.25, 1.02), ylim=(-0.02, 1.02))
    legend(figure, axes, columns=1)
    return svg(figure)


def peak_forces(rows: Sequence[Row]) -> str:
    """Return the share of episodes whose peak force exceeds a value, by planner."""
    figure, axes = panel(
        "force F [N] (largest 10 ms mean of a contact)", "episodes above F [%]"
    )
    names, told = [*dict.fromkeys(row.planner for row in rows)], oracles(rows)
    for k, name in enumerate(names):
        own = np.sort([r.filtered_peak_force_n for r in rows if r.planner == name])
        above = 100.0 * (1.0 - np.arange(1, len(own) + 1) / len(own))
        colour, _ = style(name, names)
        axes.step(
            [0.0, *own], [100.0, *above], where="post", color=colour, lw=1.6,
            ls=_DASHES[k % len(_DASHES)], label=_label(name, told),
        )  # fmt: skip
    axes.set_xscale("symlog", linthresh=1.0)
    axes.set_xlim(left=0.0)
    axes.set_ylim(-2, 102)
    legend(figure, axes)
    return svg(figure)


def learning_curves(
    missions: dict[str, dict[str, Any]], family: str, told: Sequence[str] = ()
) -> str:
    """Return the mean steps of each day of a family's missions, a curve a planner.

    Args:
        missions: Entry `missions` of a summary.
        family: Which family.
        told: The planners that are oracles.
    """
    figure, axes = panel("day of the mission", "mean steps, 95 % interval")
    names = [name for name, own in missions.items() if family in own]
    for k, name in enumerate(names):
        found = [day["mean"]["steps"] for day in missions[name][family]["by_day"]]
        colour, marker = style(name, names)
        # A little apart, so that intervals do not hide each other.
        x = [1 + n + 0.06 * (k - 0.5 * (len(names) - 1)) for n in range(len(found))]
        y = [c["mean"] for c in found]
        ends = [
            [0.0 if c[end] is None else abs(c[end] - c["mean"]) for c in found]
            for end in ("low", "high")
        ]
        axes.errorbar(
            x, y, yerr=ends, color=colour, marker=marker, ms=5, lw=1.2,
            ls=_DASHES[k % len(_DASHES)], label=_label(name, told),
        )  # fmt: skip
    axes.set_xticks(range(1, 1 + max(missions[n][family]["days"] for n in names)))
    legend(figure, axes, columns=1 if max(map(len, names)) > 20 else 3)
    return svg(figure)


def _beaten(point: tuple[float, float], others: Any) -> bool:
    """Whether another one costs no more, succeeds no less, and is not the same."""
    x, y = point
    return any(a <= x and b >= y and (a, b) != (x, y) for a, b in others)


def style(name: str, names: Sequence[str]) -> tuple[str, str]:
    """Return colour and marker of a planner; strangers take what is left."""
    if name in _KNOWN:
        return _STYLES[_KNOWN.index(name)]
    free = [k for k, known in enumerate(_KNOWN) if known not in names]
    strangers = [other for other in names if other not in _KNOWN]
    place = strangers.index(name)
    return _STYLES[free[place % len(free)] if free else place % len(_STYLES)]


def _label(planner: str, told: Sequence[str]) -> str:
    """Return a planner's name in a legend, where `$` would begin a formula.

    A label that begins with an underscore would be left out.
    """
    name = marked(printable(planner), planner in told).replace("$", r"\$")
    return f" {name}" if name.startswith("_") else name


def panel(x: str, y: str) -> tuple[Figure, Axes]:
    """Return an empty figure of one panel, and its axes with these labels."""
    with mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=SIZE_IN, layout="constrained")
        axes = figure.add_subplot()
    frame(axes, x, y)
    return figure, axes


def frame(axes: Axes, x: str, y: str) -> None:
    """Label a panel, and take away what is no data."""
    axes.set_xlabel(x, color=INK)
    axes.set_ylabel(y, color=INK)
    axes.grid(color="#eeeeee", lw=0.8)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def legend(figure: Figure, axes: Axes, columns: int = 3) -> None:
    """Put the legend below the panel."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=columns, frameon=False,
        fontsize=8,
    )  # fmt: skip


def svg(figure: Figure) -> str:
    """Return the figure as SVG; equal figures give equal text."""
    out = StringIO()
    with mpl.rc_context({"svg.hashsalt": "beacon-mj", "svg.fonttype": "path"}):
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    return out.getvalue()
