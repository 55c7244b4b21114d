"""A sweep as tables: Table I, the selection split, Table III."""

import math
from collections.abc import Sequence
from pathlib import Path

from msgspec import UnsetType
from rich.table import Table

from beacon_mj.eval.runs.variants import variant_name
from beacon_mj.eval.statistics.oracles import NOTE, marked, oracles_of
from beacon_mj.eval.statistics.summary import OVERALL
from beacon_mj.eval.studies.sweep import Score, Span
from beacon_mj.eval.studies.sweep_run import Gain, Line, Result
from beacon_mj.rendering.tables import Tabular, add_line, plain_table

SHOWN = 15  #: Configurations in the table of the selection split.
LEGEND = (
    "alone: the best value with all others at their default; best: in the selected\n"
    "configuration. Selected by success, then by energy over all episodes.\n"
    "Brackets are 95 % intervals: Wilson's for rates, BCa bootstrap for energies."
)


class Sweep(Tabular):
    """What a sweep found.

    Attributes:
        result: Scores, the selected configuration, and the report's tables.
        folder: Where its stages are, and `sweep.json`.
    """

    def __init__(self, result: Result, folder: Path) -> None:
        """Hold a result; see `beacon_mj.sweep`, which makes it."""
        self.result = result
        self.folder = folder

    def tables(self) -> Sequence[Table | str]:
        """Return Table I, the selection split, Table III, and what was gained."""
        found = self.result
        return [
            _table_i(found.table_i), "",
            _selection(found), "",
            *_confirmed(found),
            _table_iii(found),
            _gained(found.gain),
            LEGEND,
            *([NOTE] if oracles_of(found.report) else []),
        ]  # fmt: skip


def _table(title: str, *headings: str) -> Table:
    table = plain_table(title)
    table.add_column(headings[0], overflow="fold")
    for name in headings[1:]:
        table.add_column(name, justify="right", no_wrap=True)
    return table


def _table_i(lines: Sequence[Line]) -> Table:
    table = _table("Table I", "parameter", "default", "swept", "alone", "best")
    for line in lines:
        swept = ", ".join(line.values)
        add_line(table, line.field, line.default, swept, line.alone or "-", line.best)
    return table


def _selection(result: Result) -> Table:
    """Return the best configurations on the selection split."""
    request, ranked = (
        result.request,
        sorted(result.scores, key=lambda score: score.merit, reverse=True),
    )
    where = "planar, " if request.world == "planar" else ""
    seed, number = request.select_seed, len(ranked)
    title = f"selection, {where}seed {seed}, {number} configurations"
    table = _table(title, "changes", "solved", "% [95 % CI]", "energy J", "steps")
    for score in ranked[:SHOWN]:
        _add_score(table, score)
    return table


def _confirmed(result: Result) -> list[Table | str]:
    """Return the finalists in MuJoCo, where they were selected in another world."""
    if isinstance(result.confirmed, UnsetType):
        return []
    title = f"confirmed in MuJoCo, seed {result.request.select_seed}"
    table = _table(title, "changes", "solved", "% [95 % CI]", "energy J", "steps")
    for score in sorted(result.confirmed, key=lambda s: s.merit, reverse=True):
        _add_score(table, score)
    agreement = (
        ""
        if isinstance(result.agreement, UnsetType)
        else _correlation(result.agreement)
    )
    return [table, agreement, ""]


def _correlation(found: Span) -> str:
    """Return the rank correlation of two worlds in words."""
    value, low, high = found
    if math.isnan(value):
        return "rank correlation of both worlds: none, all are equal in one of them"
    ends = "" if low is None else f" [{low:+.2f},{high:+.2f}]"
    return f"rank correlation of both worlds over these: {value:+.2f}{ends}"


def _add_score(table: Table, score: Score) -> None:
    name = variant_name("", score.settings)[1:-1] or "default"
    steps = f"{score.steps:.0f}"
    add_line(table, name, *_success(score.success), _energy(score), steps)


def _table_iii(result: Result) -> Table:
    """Return success and energy on the report split."""
    tables = result.report["tables"]
    title = f"Table III, seed {result.request.seed}"
    table = _table(title, "planner", "solved", "% [95 % CI]", "energy J")
    for planner, cells in tables.items():
        cell = cells[OVERALL]
        energy = cell["mean"]["energy_j"]
        ends = (energy["mean"], energy["low"], energy["high"])
        who = marked(planner, planner in oracles_of(result.report))
        who += " (selected)" if planner == result.name else ""
        add_line(table, who, *_success(cell["success"]), _span(*ends))
    return table


def _gained(gain: Gain | None) -> str:
    if gain is None:
        return "The default is the selected configuration."
    return (
        f"selected less default, same scenes: success {100 * gain.success:+.1f} % "
        f"(McNemar p = {gain.p_value:.2g}), energy {_span(*gain.energy_j)} J"
    )


def _success(cell: dict[str, float]) -> tuple[str, str]:
    low, high = 100 * cell["low"], 100 * cell["high"]
    return (
        f"{cell['count']}/{cell['n']}",
        f"{100 * cell['rate']:.0f} [{low:.0f},{high:.0f}]",
    )


def _energy(score: Score) -> str:
    return _span(*score.energy_j)


def _span(mean: float, low: float | None, high: float | None) -> str:
    if low is None or high is None:
        return f"{mean:.1f}"
    return f"{mean:.1f} [{low:.1f},{high:.1f}]"
