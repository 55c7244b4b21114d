"""The tables of a run's summary, at most 80 columns wide."""

from collections.abc import Sequence
from typing import Any

from rich.table import Table

from beacon_mj.eval.statistics.grouping import shown
from beacon_mj.eval.statistics.oracles import NOTE, marked, oracles_of
from beacon_mj.eval.statistics.summary import OUTCOMES, OVERALL
from beacon_mj.rendering.tables import Prose, Tabular, add_line, plain_table

#: Of the columns after the planner's name.
HEADINGS = (
    "\nsolved",
    "%\n[95 % CI]",
    "clean\n%",
    "\nsteps",
    "path m\nall",
    "path m\nsolved",
    "con-\ntacts",
    "energy\nJ",
    "bro-\nken",
)
#: What is left out where there is no room for it, in this order.
SPARE = ("con-\ntacts", "path m\nall", "energy\nJ", "bro-\nken", "path m\nsolved")
LEGEND = Prose(
    "\nsolved: reached the goal, with its Wilson interval; clean: and broke nothing. "
    "Means are over all episodes, but for the path over solved ones."
)


class SummaryTable(Tabular):
    """Overall and per-family tables, then how episodes ended."""

    def __init__(self, summary: dict[str, Any], notes: Sequence[str] = ()) -> None:
        """Show a summary, see `summarize`, and what is to be said of it."""
        self.summary = summary
        self.notes = tuple(notes)

    def tables(self) -> Sequence[Table | str]:
        """Return a table a family, and one of the outcomes."""
        cells, told = self.summary["tables"], oracles_of(self.summary)
        names = dict.fromkeys(f for own in cells.values() for f in own)
        parts: list[Table | str] = []
        for name in shown([*names]):
            parts += [_results(name, cells, told), ""]
        missions = self.summary.get("missions", {})
        for family in dict.fromkeys(f for own in missions.values() for f in own):
            parts += [_missions(family, missions, told), ""]
        notes = [NOTE, *self.notes] if told else self.notes
        return [*parts, _outcomes(cells, told), LEGEND, *notes]


def _table(title: str, spare: Sequence[str] = ()) -> Table:
    table = plain_table(title, spare=spare)
    table.add_column("planner", min_width=12, max_width=14, overflow="fold")
    return table


def _results(family: str, tables: dict[str, Any], told: Sequence[str]) -> Table:
    """Return one table: a line a planner."""
    n = max(cells[family]["n"] for cells in tables.values() if family in cells)
    table = _table(f"{family}, {n} scenes", SPARE)
    for name in HEADINGS:
        table.add_column(name, justify="right", no_wrap=True)
    for planner, cells in tables.items():
        if family in cells:
            add_line(table, _label(planner, told), *_numbers(cells[family]))
    return table


def _numbers(cell: dict[str, Any]) -> list[str]:
    won, mean = cell["success"], cell["mean"]
    return [
        f"{won['count']}/{won['n']}",
        f"{_percent(won['rate'])} [{_percent(won['low'])},{_percent(won['high'])}]",
        _percent(cell["clean_success"]["rate"]),
        _number(mean["steps"], 0),
        _number(mean["path_length_m"], 2),
        _number(cell["mean_over_successes"]["path_length_m"], 2),
        _number(mean["contacts"], 2),
        _number(mean["energy_j"], 0),
        _number(mean["obstacles_broken"], 2),
    ]


def _missions(family: str, missions: dict[str, Any], told: Sequence[str]) -> Table:
    """Return one table of whole missions: a line a planner."""
    found = {name: own[family] for name, own in missions.items() if family in own}
    n = max(cell["n"] for cell in found.values())
    days = max(cell["days"] for cell in found.values())
    title = f"{family}, {n} missions of {days} days, all days together"
    table = _table(title, ("bro-\nken", "[95 % CI]"))
    for heading in ("\nsolved", "\nsteps", "[95 % CI]", "failed\npushes", "bro-\nken"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("steps\nday by day", justify="right")
    for planner, cell in found.items():
        steps, won = cell["mean"]["steps"], cell["success"]
        ends = "-"
        if steps["low"] is not None:
            ends = f"[{steps['low']:.0f},{steps['high']:.0f}]"
        add_line(
            table,
            _label(planner, told),
            f"{won['count']}/{won['n']}",
            _number(steps, 0),
            ends,
            _number(cell["mean"]["failed_pushes"], 1),
            _number(cell["mean"]["obstacles_broken"], 2),
            " ".join(_number(day["mean"]["steps"], 0) for day in cell["by_day"]),
        )
    return table


def _outcomes(tables: dict[str, Any], told: Sequence[str]) -> Table:
    """Return how the episodes of each planner ended, in counts."""
    total = {p: cells[OVERALL]["outcomes"] for p, cells in tables.items()}
    used = [o for o in OUTCOMES if any(counts[o] for counts in total.values())]
    table = _table("how episodes ended, all scenes")
    for outcome in used:
        table.add_column(outcome.replace("_", "\n"), justify="right")
    for planner, counts in total.items():
        add_line(table, _label(planner, told), *(str(counts[o]) for o in used))
    return table


def _label(planner: str, told: Sequence[str]) -> str:
    """Return a planner's name, with the settings of a variant on their own lines."""
    name, bracket, settings = planner.partition("[")
    lines = settings.removesuffix("]").replace("protocol.", "").split(",")
    shown = marked(name, planner in told)
    return "\n ".join([shown, *lines]) if bracket else shown


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.0f}"


def _number(cell: dict[str, Any], digits: int) -> str:
    return "-" if cell["mean"] is None else f"{cell['mean']:.{digits}f}"
