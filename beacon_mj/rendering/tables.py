"""Tables of results: on a terminal, as plain text, and in a notebook."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from io import StringIO
from typing import Any, TypeVar, overload

from rich.box import SIMPLE_HEAD
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.table import Table
from rich.text import Text

from beacon_mj.errors import printable

T = TypeVar("T")
WIDTH = 80  #: Width of plain text, and of the tables themselves, in characters.
_HTML = '<pre style="line-height:1.2;font-family:monospace">{code}</pre>'


def plain(text: str) -> Text:
    """Return a text that is shown as it is: no markup, no emoji, nothing hidden."""
    return Text(printable(text))


class PlainTable(Table):
    """A table whose texts are shown as they are; see `plain`."""

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
    """Write a result to a console; a line of text, such as a path, is never cut."""
    for part in result.tables():
        if isinstance(part, str):
            console.print(plain(part), soft_wrap=True)
        else:
            console.print(part)


def plain_table(title: str = "", **options: Any) -> Table:
    """Return an empty table in the style of all results, as wide as it needs.

    Args:
        title: What stands above it, as it is.
        options: Further ones of rich's `Table`.
    """
    return PlainTable(
        title=plain(title) if title else None,
        title_justify="left",
        title_style="bold",
        box=SIMPLE_HEAD,
        show_edge=False,
        padding=options.pop("padding", 0),
        **options,
    )


def add_line(table: Table, *cells: str) -> None:
    """Add a line of texts to a table."""
    table.add_row(*cells)


def _renderables(parts: Sequence[Table | str]) -> Iterator[RenderableType]:
    for part in parts:
        yield plain(part) if isinstance(part, str) else part


def _shown(cell: Any) -> Any:
    return plain(cell) if isinstance(cell, str) else cell
