"""`beacon-mj planners`."""

import inspect

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table

from beacon_mj.cli.tables import console
from beacon_mj.errors import PlannerError
from beacon_mj.eval.runs.overrides import flat
from beacon_mj.planners.base import Planner
from beacon_mj.planners.registry import ALIASES, load_planner, planner_names


def planners(name: str | None = None, /) -> None:
    """List the planners, or the fields that --set can change in one of them.

    Parameters
    ----------
    name
        A planner's name, or path/to/file.py:Class.
    """
    if name is None:
        _all()
    else:
        _one(*load_planner(name))


def _all() -> None:
    table = Table("planner", "what it is", box=SIMPLE_HEAD)
    for name in planner_names():
        aliases = [a for a, target in ALIASES.items() if target == name]
        label = ", ".join([name, *aliases])
        try:
            table.add_row(label, _headline(load_planner(name)[1]))
        except PlannerError as error:
            table.add_row(label, str(error))
    console().print(table)


def _one(name: str, cls: type[Planner]) -> None:
    screen = console()
    screen.print(inspect.getdoc(cls) or "", markup=False)
    config = cls.Config()
    notes = _notes(config)
    table = Table(box=SIMPLE_HEAD)
    for heading in ("field", "default", ""):
        table.add_column(heading, overflow="fold")
    for field, default in flat(config).items():
        cells = f"{name}.{field}", _settable(default), notes.get(field, "")
        table.add_row(*map(escape, cells))
    screen.print(table)


def _settable(value: object) -> str:
    """Return a value as --set takes it."""
    if isinstance(value, tuple | list | frozenset | set):
        return f"[{','.join(str(each) for each in value)}]"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _headline(cls: type[Planner]) -> str:
    """Return the first sentence that documents a planner."""
    text = inspect.getdoc(inspect.getmodule(cls)) or inspect.getdoc(cls) or ""
    return text.partition("\n")[0]


def _notes(config: object) -> dict[str, str]:
    """Return the `#:` comments above the fields of a configuration, by dotted name."""
    notes = _comments(type(config))
    for name in getattr(config, "__dataclass_fields__", ()):
        inner = _notes(getattr(config, name))
        notes |= {f"{name}.{field}": note for field, note in inner.items()}
    return notes


def _comments(config: type) -> dict[str, str]:
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
