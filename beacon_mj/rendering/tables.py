"""Tables of results: on a terminal, as plain text, and in a notebook."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import replace
from io import StringIO
from typing import Any, TypeVar, overload

from rich.box import SIMPLE_HEAD
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from beacon_mj.errors import printable

T = TypeVar("T")
WIDTH = 80  #: Width of plain text, and of the tables themselves, in characters.
_HTML = '<pre style="line-height:1.2;font-family:monospace">{code}</pre>'


def plain(text: str) -> Text:
    """Return a text that is shown as it is: no markup, no emoji, nothing hidden."""
    return Text(printable(text))


class Prose(str):
    """A text that is wrapped between words where it is wider than what shows it."""


class PlainTable(Table):
    """A table whose texts are shown as they are; see `plain`.

    Attributes:
        spare: Columns that are left out where the table is too wide, in that order; a
            line below it names them.
    """

    spare: Sequence[str] = ()

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> RenderResult:
        """Yield the table, without spare columns that it has no room for."""
        fitting, out = self, list[str]()
        for name in self.spare:
            if fitting._needs(console, options) <= options.max_width:
                break
            fitting = fitting._without(name)
            out.append(" ".join(name.replace("-\n", "").split()))
        yield from Table.__rich_console__(fitting, console, options)
        if out:
            yield plain(f"no room for: {', '.join(out)}")

    def _needs(self, console: Console, options: ConsoleOptions) -> int:
        """Return the width at which no cell is wrapped or cut off, in characters."""
        endless = options.update(max_width=10_000)
        return Measurement.get(console, endless, self).maximum

    def _without(self, name: str) -> "PlainTable":
        """Return the table without a column."""
        out = copy(self)
        kept = [c for c in self.columns if str(c.header) != name]
        out.columns = [replace(c, _index=i) for i, c in enumerate(kept)]
        return out

    def add_column(
        self, header: RenderableType = "", *args: Any, **options: Any
    ) -> None:
        """Add a column; see rich's `Table`."""
        super().add_column(_shown(header), *args, **options)

    def add_row(self, *cells: RenderableType | None, **options: Any) -> None:
        """Add a line; see rich's `Table`."""
        super().add_row(*(_shown(cell) for cell in cells), **options)


class Tabular(ABC):
    """A result that shows itself as tables.

    `print` gives plain text, a notebook HTML, and rich's `print` what fits a terminal.
    """

    @abstractmethod
    def tables(self) -> Sequence[Table | str]:
        """Return the tables, and what is to be said between them, in order."""

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> RenderResult:
        """Yield the tables; a text is shown as it is."""
        yield from _renderables(self.tables())

    def __str__(self) -> str:
        """Return the tables as plain text, at most 80 characters wide.

        A line of text between them stays whole.
        """
        console = Console(
            file=StringIO(), width=WIDTH, highlight=False, color_system=None
        )
        with console.capture() as found:
            write(console, self)
        return "\n".join(line.rstrip() for line in found.get().splitlines())

    def _repr_html_(self) -> str:
        """Return the tables for a notebook."""
        console = Console(file=StringIO(), width=WIDTH, highlight=False, record=True)
        console.print(self)
        return str(console.export_html(inline_styles=True, code_format=_HTML))


class Listing(Tabular, Sequence[T]):
    """A sequence of results that shows itself as tables."""

    def __init__(self, items: Sequence[T]) -> None:
        """Hold the items, in order."""
        self._items = tuple(items)

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[T]: ...
    def __getitem__(self, index: int | slice) -> T | Sequence[T]:
        """Return one item, or some of them."""
        return self._items[index]

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._items)


def write(console: Console, result: Tabular) -> None:
    """Write a result to a console; a text, such as a path, is only cut if `Prose`."""
    for part in result.tables():
        if isinstance(part, str):
            console.print(plain(part), soft_wrap=not isinstance(part, Prose))
        else:
            console.print(part)


def plain_table(title: str = "", *, spare: Sequence[str] = (), **options: Any) -> Table:
    """Return an empty table in the style of all results, as wide as it needs.

    Args:
        title: What stands above it, as it is.
        spare: Headings of columns that may be left out, the first one first.
        options: Further ones of rich's `Table`.
    """
    table = PlainTable(
        title=plain(title) if title else None,
        title_justify="left",
        title_style="bold",
        box=SIMPLE_HEAD,
        show_edge=False,
        padding=options.pop("padding", 0),
        **options,
    )
    table.spare = tuple(spare)
    return table


def add_line(table: Table, *cells: str) -> None:
    """Add a line of texts to a table."""
    table.add_row(*cells)


def _renderables(parts: Sequence[Table | str]) -> Iterator[RenderableType]:
    for part in parts:
        yield plain(part) if isinstance(part, str) else part


def _shown(cell: Any) -> Any:
    return plain(cell) if isinstance(cell, str) else cell
