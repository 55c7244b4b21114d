"""`beacon-mj planners`."""

import inspect

from rich.box import SIMPLE_HEAD
from rich.table import Table

from beacon_mj.cli.tables import console
from beacon_mj.errors import PlannerError
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
    notes = _notes(cls.Config)
    table = Table("field", "default", "", box=SIMPLE_HEAD)
    for field, default in vars_of(cls.Config()).items():
        table.add_row(f"{name}.{field}", str(default), notes.get(field, ""))
    screen.print(table)


def vars_of(config: object) -> dict[str, object]:
    """Return the fields of a configuration with their values."""
    fields = getattr(config, "__dataclass_fields__", ())
    return {name: getattr(config, name) for name in fields}


def _headline(cls: type[Planner]) -> str:
    """Return the first sentence that documents a planner."""
    text = inspect.getdoc(inspect.getmodule(cls)) or inspect.getdoc(cls) or ""
    return text.partition("\n")[0]


def _notes(config: type[object]) -> dict[str, str]:
    """Return the `#:` comments that stand above the fields of a class."""
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
