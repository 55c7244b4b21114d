"""Planners by name. A built-in one is imported when it is asked for, not before."""

import importlib
import importlib.util
import inspect
import sys
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from beacon_mj.errors import PlannerError, describe, unknown
from beacon_mj.planners.base import Planner

GROUP = "beacon_mj.planners"  #: Entry-point group through which third parties join.
#: The planners of the paper's Table II: what `all` stands for.
PAPER = {
    "bug1": "beacon_mj.planners.bug1:Bug1",
    "bug2": "beacon_mj.planners.bug2:Bug2",
    "dstar-lite": "beacon_mj.planners.dstar_lite:DStarLitePlanner",
    "semantic": "beacon_mj.planners.semantic:Semantic",
    "beacon": "beacon_mj.planners.beacon:Beacon",
}
#: Planners of our own; `beacon` stays the paper's.
OURS = {"beacon-voi": "beacon_mj.planners.beacon_voi:BeaconVoi"}
#: Reference planners: beside the table, never in it. `clairvoyant` is told the truth.
REFERENCE = {
    "impact": "beacon_mj.planners.impact:Impact",
    "push-through": "beacon_mj.planners.push_through:PushThrough",
    "clairvoyant": "beacon_mj.planners.clairvoyant:Clairvoyant",
}
ALIASES = {"bug": "bug1"}


def planner_names() -> dict[str, str]:
    """Return `module:Class` of every planner by name.

    A third party's planner cannot take the name of a built-in one.
    """
    third = {e.name: e.value for e in entry_points(group=GROUP)}
    return third | PAPER | OURS | REFERENCE


def file_planner(spec: str) -> str | None:
    """Return the class that `path/to/file.py:ClassName` names; None for a name."""
    path, _, member = spec.rpartition(":")
    return member if path.endswith(".py") else None


def load_planner(spec: str) -> tuple[str, type[Planner]]:
    """Return name and class of the planner that `spec` stands for.

    Args:
        spec: A name, an alias, or `path/to/file.py:ClassName`, whose name is the
            class's.

    Raises:
        PlannerError: If there is no such planner, or it is no complete `Planner`.
    """
    path, _, member = spec.rpartition(":")
    if path.endswith(".py"):
        return member, _from_file(spec, Path(path), member)
    name, known = ALIASES.get(spec, spec), planner_names()
    if name not in known:
        raise PlannerError(unknown("planner", spec, [*known, *ALIASES]))
    return name, _from_module(spec, known[name])


def _from_module(spec: str, target: str) -> type[Planner]:
    """Return the class at `module:Class`; `spec` is how the user called it."""
    module, _, name = target.partition(":")
    try:
        return _member(spec, importlib.import_module(module), name)
    except ImportError as error:
        raise PlannerError(f"Planner {spec!r} cannot be imported: {error}.") from error


def _from_file(spec: str, path: Path, name: str) -> type[Planner]:
    """Return class `name` of a Python file, whose folder need not be on the path."""
    if not path.is_file():
        raise PlannerError(f"{path}: expected a Python file but there is none.")
    unique = f"beacon_mj_planner_{path.stem}"
    found = importlib.util.spec_from_file_location(unique, path)
    if found is None or found.loader is None:
        raise PlannerError(f"{path}: expected a Python file with a planner.")
    module = sys.modules[unique] = importlib.util.module_from_spec(found)
    try:
        found.loader.exec_module(module)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        why = describe(error)
        raise PlannerError(f"{path}: cannot be imported: {why}.") from error
    return _member(spec, module, name)


def _member(spec: str, module: ModuleType, name: str) -> type[Planner]:
    found: object = getattr(module, name, None)
    if not (inspect.isclass(found) and issubclass(found, Planner)):
        planners = [n for n, value in vars(module).items() if _is_planner(value)]
        raise PlannerError(f"{spec}: {unknown('planner class', name, planners)}")
    missing = sorted(found.__abstractmethods__)
    if not hasattr(found, "Config"):
        missing.append("Config")
    if missing:
        raise PlannerError(
            f"{spec}: expected a planner with reset(), act() and a Config dataclass "
            f"but it lacks {', '.join(missing)}."
        )
    return found


def _is_planner(value: object) -> bool:
    return inspect.isclass(value) and issubclass(value, Planner) and value != Planner
