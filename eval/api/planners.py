"""The list of planners, and what can be set in one of them."""

import inspect
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from msgspec import UnsetType
from rich.table import Table

from beacon_mj.errors import PlannerError
from beacon_mj.eval.runs.overrides import flat
from beacon_mj.planners.base import Planner
from beacon_mj.planners.registry import ALIASES, load_planner, planner_names
from beacon_mj.rendering.tables import Listing, Prose, Tabular, add_line, plain_table


@dataclass(frozen=True, kw_only=True, slots=True)
class PlannerSummary:
    """A planner that goes by a name.

    Attributes:
        name: Its name.
        aliases: Its other names.
        summary: What it is, in a sentence, or why it cannot be imported.
    """

    name: str
    aliases: tuple[str, ...]
    summary: str


class Planners(Listing[PlannerSummary]):
    """The planners, as a sequence and as a table."""

    def tables(self) -> Sequence[Table | str]:
        """Return a line a planner."""
        table = plain_table(padding=(0, 1))
        table.add_column("planner")
        table.add_column("what it is")
        for each in self:
            add_line(table, ", ".join([each.name, *each.aliases]), each.summary)
        return [table]


@dataclass(frozen=True, kw_only=True, slots=True)
class PlannerField:
    """A field of a planner's configuration: its default, and what it means."""

    name: str
    default: object
    meaning: str


class PlannerDescription(Tabular):
    """What a planner is, and what can be set in it.

    Attributes:
        name: Its name.
        text: Its documentation.
        fields: The fields of its configuration; a nested one has a dotted name.
    """

    def __init__(self, name: str, text: str, fields: Sequence[PlannerField]) -> None:
        """Hold a description; see `describe_planner`, which makes it."""
        self.name = name
        self.text = text
        self.fields = tuple(fields)

    @property
    def _widest(self) -> int:
        """Length of the longest name."""
        return max((len(f"{self.name}.{f.name}") for f in self.fields), default=0)

    def tables(self) -> Sequence[Table | str]:
        """Return the documentation, then a line a field."""
        table = plain_table(padding=(0, 1))
        # Names are to be copied whole: none is cut off, whatever the width.
        table.add_column("field", min_width=self._widest, no_wrap=True)
        table.add_column("default", overflow="fold")
        table.add_column("")
        for each in self.fields:
            name = f"{self.name}.{each.name}"
            add_line(table, name, settable(each.default), each.meaning)
        return [Prose(self.text), table]


def list_planners() -> Planners:
    """Return the planners that go by a name. The same as `beacon-mj planners`."""
    return Planners(
        [
            PlannerSummary(
                name=name,
                aliases=tuple(a for a, target in ALIASES.items() if target == name),
                summary=_summary(name),
            )
            for name in planner_names()
        ]
    )


def describe_planner(planner: str | type[Planner]) -> PlannerDescription:
    """Return what a planner is, and the fields that can be set in it.

    The same as `beacon-mj planners NAME`.

    Args:
        planner: Name, `path/to/file.py:Class`, or class.

    Raises:
        PlannerError: If there is no such planner.
    """
    if isinstance(planner, str):
        name, cls = load_planner(planner)
    else:
        name, cls = planner.__name__, planner
    return PlannerDescription(name, inspect.getdoc(cls) or "", [*_fields(cls.Config())])


def _fields(config: object) -> Iterator[PlannerField]:
    """Yield the fields of a configuration, those of nested ones after a dot."""
    notes = _notes(config)
    for name, value in flat(config).items():
        yield PlannerField(name=name, default=value, meaning=notes.get(name, ""))


def _summary(name: str) -> str:
    """Return the first sentence that documents a planner."""
    try:
        cls = load_planner(name)[1]
    except PlannerError as error:
        return str(error)
    text = inspect.getdoc(inspect.getmodule(cls)) or inspect.getdoc(cls) or ""
    return text.partition("\n")[0]


def _notes(config: object) -> dict[str, str]:
    """Return the `#:` comments above the fields of a configuration, by dotted name."""
    notes: dict[str, str] = {}
    for cls in reversed(type(config).__mro__[:-1]):  # `object` has no fields.
        notes |= field_comments(cls)
    for name in getattr(config, "__dataclass_fields__", ()):
        inner = _notes(getattr(config, name))
        notes |= {f"{name}.{field}": note for field, note in inner.items()}
    return notes


def field_comments(config: type) -> dict[str, str]:
    """Return the `#:` comments above the fields of a class."""
    try:
        lines = [line.strip() for line in inspect.getsource(config).splitlines()]
    except (OSError, TypeError):
        return {}
    notes: dict[str, str] = {}
    comment = ""
    for line in lines:
        if line.startswith("#:"):
            comment = f"{comment} {line[2:].strip()}".strip()
        elif comment:
            notes[line.partition(":")[0]] = comment
            comment = ""
    return notes


def settable(value: object) -> str:
    """Return a value as --set takes it."""
    if isinstance(value, frozenset | set):
        value = sorted(value)
    if isinstance(value, tuple | list):
        return f"[{','.join(str(each) for each in value)}]"
    return str(value).lower() if isinstance(value, bool | UnsetType) else str(value)
