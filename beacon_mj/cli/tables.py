"""The summary's tables on a terminal, at most 80 columns wide."""

from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from beacon_mj.eval.statistics.summary import OUTCOMES, OVERALL

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
LEGEND = (
    "\nsolved: reached the goal, with its Wilson interval; clean: and broke nothing.\n"
    "Means are over all episodes, but for the path over solved ones."
)
WIDTH = 80  #: Width of a pipe, and the least width of a terminal.


def console() -> Console:
    """Return the console that results are printed on."""
    found = Console(highlight=False)
    if not found.is_terminal or found.width < WIDTH:
        return Console(highlight=False, width=WIDTH)
    return found


def show(summary: dict[str, Any]) -> None:
    """Print overall and per-family tables, then how episodes ended."""
    tables = summary["tables"]
    families = dict.fromkeys(f for cells in tables.values() for f in cells)
    screen = console()
    if len(families) == 2:  # One family: overall would say the same again.
        del families[OVERALL]
    for family in families:
        screen.print(_results(family, tables), "")
    screen.print(_outcomes(tables))
    screen.print(LEGEND)


def plain_table(title: str, **options: Any) -> Table:
    """Return an empty table in the style of all results, as wide as it needs."""
    return Table(
        title=title,
        title_justify="left",
        title_style="bold",
        box=SIMPLE_HEAD,
        show_edge=False,
        padding=0,
        **options,
    )


def _table(title: str) -> Table:
    table = plain_table(title)
    table.add_column("planner", min_width=12, max_width=14, overflow="fold")
    return table


def _results(family: str, tables: dict[str, Any]) -> Table:
    """Return one table: a line a planner."""
    n = max(cells[family]["n"] for cells in tables.values() if family in cells)
    table = _table(f"{family}, {n} scenes")
    for name in HEADINGS:
        table.add_column(name, justify="right", no_wrap=True)
    for planner, cells in tables.items():
        if family in cells:
            table.add_row(planner, *_numbers(cells[family]))
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


def _outcomes(tables: dict[str, Any]) -> Table:
    """Return how the episodes of each planner ended, in counts."""
    total = {p: cells[OVERALL]["outcomes"] for p, cells in tables.items()}
    used = [o for o in OUTCOMES if any(counts[o] for counts in total.values())]
    table = _table("how episodes ended, all scenes")
    for outcome in used:
        table.add_column(outcome.replace("_", "\n"), justify="right")
    for planner, counts in total.items():
        table.add_row(planner, *(str(counts[o]) for o in used))
    return table


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100 * share:.0f}"


def _number(cell: dict[str, Any], digits: int) -> str:
    return "-" if cell["mean"] is None else f"{cell['mean']:.{digits}f}"
