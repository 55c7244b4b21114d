"""Tables on terminals of any width: nothing is cut off, and nothing eaten."""

from io import StringIO

import pytest
from rich.console import Console
from rich.table import Table

import beacon_mj
from beacon_mj.cli.views.progress import Tally
from beacon_mj.eval.statistics.summary import summarize
from beacon_mj.eval.statistics.summary_table import HEADINGS, SummaryTable
from beacon_mj.rendering.tables import Prose, Tabular, plain_table, write
from tests.eval.statistics.test_compare import rows

WIDTHS = (60, 80, 200)


def shown(result: Tabular, width: int) -> list[str]:
    out = StringIO()
    write(Console(file=out, width=width, highlight=False), result)
    return [line.rstrip() for line in out.getvalue().splitlines()]


def summary() -> SummaryTable:
    found = [
        row
        for name in ("beacon", "push-through", "beacon[push_bias=0.5]")
        for row in rows([14.0, 15.0, 16.0], [True, True, False], name)
    ]
    return SummaryTable(summarize(found))


@pytest.mark.parametrize("width", WIDTHS)
def test_tables_of_results_fit(width: int) -> None:
    lines = shown(summary(), width)
    assert max(map(len, lines)) <= width
    assert not any("…" in line for line in lines)
    assert any("push_bias=0.5" in line for line in lines)
    left_out = [line for line in lines if line.startswith("no room for: ")]
    assert bool(left_out) == (width < 75)
    table = "\n".join(lines[: lines.index("")])
    for heading in HEADINGS:
        last = heading.split("\n")[-1]
        name = " ".join(heading.replace("-\n", "").split())
        assert last in table or name in left_out[0]


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("name", ["list_planners", "list_families"])
def test_lists_use_the_width_there_is(name: str, width: int) -> None:
    found = getattr(beacon_mj, name)()
    lines = shown(found, width)
    paths = [line for line in lines if line.startswith("/")]
    assert max(len(line) for line in lines if line not in paths) <= width
    assert len(lines) == len(shown(found, width + 1)) or width < 200
    assert len(lines) <= len(shown(found, 50))
    assert any(len(line) > 0.7 * min(width, 130) for line in lines)
    assert not any("…" in line for line in lines)


def test_prose_is_wrapped_between_words_and_markup_is_text() -> None:
    class Said(Tabular):
        def tables(self) -> list[str]:
            return [Prose("set [bold]sharing=[kind,scale][/bold] " * 6)]

    lines = shown(Said(), 60)
    assert (
        " ".join(lines).split()
        == ("set [bold]sharing=[kind,scale][/bold] " * 6).split()
    )
    assert max(map(len, lines)) <= 60


def test_spare_columns_go_in_their_order_and_are_named() -> None:
    class Wide(Tabular):
        def tables(self) -> list[Table | str]:
            table = plain_table(spare=("b", "c"))
            for name in "abcd":
                table.add_column(name, no_wrap=True)
            table.add_row("x" * 9, "y" * 9, "z" * 9, "w" * 9)
            return [table]

    assert "no room" not in "".join(shown(Wide(), 39))
    assert shown(Wide(), 38)[-1] == "no room for: b"
    assert shown(Wide(), 20)[-1] == "no room for: b, c"
    assert "y" not in "".join(shown(Wide(), 38))


def test_progress_says_in_words_what_is_not_known_yet() -> None:
    tally = Tally(8)
    assert tally.line() == "0/8 episodes, none finished yet, time left unknown"
    tally.add([])
    for row in rows([4.0] * 8, [False] * 8, "beacon"):
        assert tally.line().startswith(f"{tally.done}/8 episodes, ")
        tally.add([row])
    assert tally.line() == "8/8 episodes, 0 % solved, done"
