"""Results on stdout, as tables or as JSON; remarks on stderr.

The one place from which commands print. Names, reasons and paths may be anybody's, so
nothing reaches a terminal but what can be printed; see `printable`.
"""

import os
import re
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from rich.console import Console

from beacon_mj.cli.standard_streams import abandon, results
from beacon_mj.errors import printable
from beacon_mj.rendering.tables import WIDTH, Tabular, plain, write

if TYPE_CHECKING:
    from beacon_mj.eval.statistics.results import Results


class _Console(Console):
    """A console that leaves it to the command line what a broken pipe means."""

    def on_broken_pipe(self) -> None:
        """Raise the `BrokenPipeError` that is being handled, and end nothing."""
        raise


def show(result: Tabular) -> None:
    """Print a result: on a terminal as wide as it is, in a pipe 80 columns wide.

    `COLUMNS` in the environment is the width of both.
    """
    console = _Console(file=results(), highlight=False)
    if not (console.is_terminal or os.environ.get("COLUMNS", "").isdigit()):
        console = _Console(file=results(), highlight=False, width=WIDTH)
    write(console, result)


def say(text: str) -> None:
    """Print a result that is a text."""
    print(printable(text), file=results())


def say_prose(text: str) -> None:
    """Print a result that is prose: on a terminal it is wrapped between words."""
    console = _Console(file=results(), highlight=False)
    if console.is_terminal:
        console.print(plain(text))
    else:
        say(text)


def show_json(value: Any) -> None:
    """Print a value as JSON; what cannot be printed is escaped as JSON does."""
    import msgspec

    text = msgspec.json.format(msgspec.json.encode(value)).decode()
    print(re.sub(r"[^\n -~]+", _escaped, text), file=results())


def remark(*lines: str) -> None:
    """Print lines on stderr, where they do not disturb results.

    A stderr that is closed or full ends no command.
    """
    for line in lines:
        _tell(f"{printable(line)}\n")


def show_page(run: "Results") -> None:
    """Write the page that ends an evaluation, and say where it is, or why it is not."""
    from beacon_mj.eval.api.reports import closing_report

    page = closing_report(run, lambda line: remark(f"note: {line}"))
    if page is not None:
        remark(f"report: {page}")


def redraw(line: str) -> None:
    """Write a line of progress over the last one, if somebody watches."""
    if sys.stderr.isatty():
        _tell(f"\r{printable(line)}")


def complain(lines: Iterable[str]) -> None:
    """Print what failed, a line each, on stderr."""
    remark(*(f"error: {' '.join(line.split())}" for line in lines))


def _tell(text: str) -> None:
    try:
        sys.stderr.write(text)
        sys.stderr.flush()
    except (OSError, ValueError):
        abandon(sys.stderr)


def _escaped(found: re.Match[str]) -> str:
    """Return characters of a JSON string as they are, or escaped."""
    return "".join(c if c.isprintable() else _unit(c) for c in found[0])


def _unit(character: str) -> str:
    units = character.encode("utf-16-be")
    pairs = (units[i : i + 2].hex() for i in range(0, len(units), 2))
    return "".join(f"\\u{pair}" for pair in pairs)
