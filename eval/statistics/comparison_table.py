"""Comparisons as tables, at most 80 columns wide."""

from collections.abc import Sequence

from rich.table import Table

from beacon_mj.eval.statistics.compare import (
    Comparison,
    Difference,
    FamilyComparison,
)
from beacon_mj.eval.statistics.grouping import OVERALL, shown
from beacon_mj.eval.statistics.oracles import NOTE, marked
from beacon_mj.rendering.tables import Listing, Prose, add_line, plain_table

#: Columns of costs that a terminal has room for, with heading and digits.
COSTS = {
    "path_length_m": ("path m\n", 2),
    "energy_j": ("energy J\n", 0),
    "energy_rolling_j": ("energy J\nkd 2 J/m", 1),
}
SPARE = ("energy J\nkd 2 J/m", "shorter\n%", "energy J\n")
LEGEND = Prose(
    "Differences, first minus second, on the same scenes, with 95 % intervals.\n"
    "success: in points, Newcombe's paired interval, p of McNemar's exact test.\n"
    "both: scenes that both solved; path and energy are compared on these (BCa).\n"
    "shorter: on how many scenes of 100 the path is; a failure has the longest one.\n"
    "missions: sums over all days of a mission, solved where every day is.\n"
    "--json has more columns, and everything over all scenes too."
)


class Comparisons(Listing[Comparison]):
    """Paired comparisons that were made together, in order.

    Attributes:
        remarks: What else differs between the runs, and what was left out.
        violations: Gates (`fail_if`) that were crossed, a line each.
    """

    def __init__(
        self,
        comparisons: Sequence[Comparison],
        remarks: Sequence[str] = (),
        violations: Sequence[str] = (),
    ) -> None:
        """Hold comparisons; see `beacon_mj.compare`, which makes them."""
        super().__init__(comparisons)
        self.remarks = tuple(remarks)
        self.violations = tuple(violations)

    def tables(self) -> Sequence[Table | str]:
        """Return a table a comparison."""
        parts: list[Table | str] = []
        for comparison in self:
            parts += [_table(comparison, len(self)), ""]
        parts.append(LEGEND)
        told = any(c.first_oracle or c.baseline_oracle for c in self)
        return [*parts, NOTE] if told else parts


def _table(comparison: Comparison, together: int) -> Table:
    first = marked(comparison.first, comparison.first_oracle)
    title = f"{first} against {marked(comparison.baseline, comparison.baseline_oracle)}"
    if together > 1:
        title += f"; success: p {_p(comparison.p_holm)} among {together} (Holm)"
    table = plain_table(title, spare=SPARE, collapse_padding=True)
    table.add_column("", width=10, overflow="fold")
    for heading in ("scenes\nboth", "success\np", *(h for h, _ in COSTS.values())):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("shorter\n%", justify="right", no_wrap=True)
    for name in shown([*comparison.cells]):
        add_line(table, name, *_numbers(comparison.cells[name]))
    for name, each in comparison.missions.items():
        if name != OVERALL:
            add_line(table, f"{name}: missions", *_numbers(each))
    return table


def _numbers(found: FamilyComparison) -> list[str]:
    success = found.rates["success"]
    path = found.costs["path_length_m"]
    better = path.improvement
    return [
        f"{found.scenes}\n{path.solved.n}",
        f"{_difference(success.difference, 0, 100.0)}\np {_p(success.p_value)}",
        *(
            _difference(found.costs[c].solved, digits)
            for c, (_, digits) in COSTS.items()
        ),
        f"{100.0 * better.probability:.0f}\n"
        f"{_ends(better.low, better.high, '.0f', 100.0)}",
    ]


def _difference(found: Difference, digits: int, scale: float = 1.0) -> str:
    if found.estimate is None:
        return "-"
    form = f"+.{digits}f"
    ends = _ends(found.low, found.high, form, scale)
    return f"{scale * found.estimate:{form}}\n{ends}"


def _ends(low: float | None, high: float | None, form: str, scale: float) -> str:
    if low is None or high is None:
        return "-"
    return f"[{scale * low:{form}},{scale * high:{form}}]"


def _p(value: float) -> str:
    return "< 0.001" if value < 0.001 else f"= {value:.3f}"
