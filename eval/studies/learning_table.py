"""Savings by learning as tables, at most 80 columns wide."""

from collections.abc import Sequence
from math import isnan

from rich.table import Table

from beacon_mj.eval.statistics.intervals import Interval
from beacon_mj.eval.studies.learning import FamilySavings, Saving, by_family
from beacon_mj.rendering.tables import Tabular, add_line, plain_table

LEGEND = (
    "Over the scenes, or missions, that both planners solved, with 95 % intervals.\n"
    "optimum: the certificate's policies on the route graph of the actual world;\n"
    "r: Pearson's correlation, with Fisher's interval."
)


class LearningSavings(Tabular):
    """What learning saved, certified and realised.

    Attributes:
        without: The planner that does not learn.
        learner: The one that does.
        scenes: The savings, one a scene or mission.
        families: The same by family.
    """

    def __init__(self, without: str, learner: str, scenes: Sequence[Saving]) -> None:
        """Hold the savings; see `beacon_mj.learning_savings`, which measures them."""
        self.without = without
        self.learner = learner
        self.scenes = tuple(scenes)
        self.families = tuple(by_family(scenes))

    def tables(self) -> Sequence[Table | str]:
        """Return a table a family."""
        head = f"without: {self.without}\nwith:    {self.learner}\n"
        return [head, *map(_table, self.families), LEGEND]


def _table(own: FamilySavings) -> Table:
    table = plain_table(f"{own.family}: {own.solved} of {own.of} scenes")
    table.add_column("", min_width=42)
    table.add_column("mean", justify="right")
    table.add_column("95 % CI", justify="right")
    least = f"least {own.least_s:.1f}"
    add_line(table, "certified value of learning [s]", f"{own.certified_s:.1f}", least)
    add_line(table, "saving of the optimum, actual worlds [s]", *_cells(own.actual_s))
    add_line(table, "saving that was realised [s]", *_cells(own.realised_s))
    add_line(table, "r of these two savings", *_cells(own.correlation, 2))
    add_line(table, "time of the optimum, actual worlds [s]", *_cells(own.optimum_s))
    add_line(table, "time of the planner that learns [s]", *_cells(own.learner_s))
    add_line(table, "r of these two times", *_cells(own.times_correlation, 2))
    return table


def _cells(interval: Interval, digits: int = 1) -> tuple[str, str]:
    mean, low, high = interval
    if isnan(mean):
        return "-", ""
    ends = "" if isnan(low) else f"[{low:.{digits}f}, {high:.{digits}f}]"
    return f"{mean:.{digits}f}", ends
