"""The figure of savings by learning: realised against those of the optimum."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from beacon_mj.errors import RunError
from beacon_mj.eval.report.figures import FAINT, legend, panel, style, svg
from beacon_mj.eval.studies.learning import FamilySavings, Saving

SUFFIXES = (".svg", ".png", ".pdf")


def write_scatter(
    scenes: Sequence[Saving], families: Sequence[FamilySavings], path: Path
) -> None:
    """Draw one point a scene, or mission, that both planners solved.

    Args:
        scenes: What was saved in each.
        families: The same by family, for the correlations.
        path: SVG, PNG or PDF file to write.

    Raises:
        RunError: If the file is of another kind.
    """
    if path.suffix not in SUFFIXES:
        raise RunError(
            f"{path}: expected a name that ends in one of {', '.join(SUFFIXES)}."
        )
    figure, axes = panel("saving of the optimum, actual world [s]", "realised [s]")
    names = [family.family for family in families]
    for family in families:
        own = [s for s in scenes if s.family == family.family and s.solved]
        colour, marker = style(family.family, names)
        r = family.correlation.estimate
        label = f"{family.family}, n = {len(own)}"
        axes.plot(
            [s.optimum.saving_s for s in own], [s.realised_s for s in own], marker,
            color=colour, ms=5, mec="white", mew=0.5,
            label=label if np.isnan(r) else f"{label}, r = {r:.2f}",
        )  # fmt: skip
    axes.axhline(0.0, color=FAINT, lw=1, zorder=0)
    axes.axline((0.0, 0.0), slope=1.0, color=FAINT, lw=2, zorder=0)
    legend(figure, axes, columns=1)
    if path.suffix == ".svg":
        path.write_text(svg(figure), encoding="utf-8")
    else:
        figure.savefig(path, dpi=200)
