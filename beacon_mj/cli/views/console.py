"""Results on stdout, as tables or as JSON; remarks on stderr."""

import sys
from collections.abc import Iterable
from typing import Any

from rich.console import Console

from beacon_mj.rendering.tables import WIDTH, Tabular, write


def show(result: Tabular) -> None:
    """Print a result: on a terminal as wide as it is, in a pipe 80 columns wide."""
    console = Console(highlight=False)
    if not console.is_terminal or console.width < WIDTH:
        console = Console(highlight=False, width=WIDTH)
    write(console, result)


def show_json(value: Any) -> None:
    """Print a value as JSON."""
    import msgspec

    print(msgspec.json.format(msgspec.json.encode(value)).decode())


def remark(*lines: str) -> None:
    """Print lines on stderr, where they do not disturb results."""
    for line in lines:
        print(line, file=sys.stderr, flush=True)


def complain(lines: Iterable[str]) -> None:
    """Print what failed, a line each, on stderr."""
    remark(*(f"error: {line}" for line in lines))
