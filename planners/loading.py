"""Importing planner classes, from modules and from files outside any package."""

import importlib
import importlib.util
import inspect
import sys
from pathlib import Path
from types import ModuleType

from beacon_mj.errors import PlannerError, unknown
from beacon_mj.planners.base import Planner


def from_module(spec: str, target: str) -> type[Planner]:
    """Return the class at `module:Class`; `spec` is how the user called it."""
    module, _, name = target.partition(":")
    try:
        return _member(spec, importlib.import_module(module), name)
    except ImportError as error:
        raise PlannerError(f"Planner {spec!r} cannot be imported: {error}.") from error


def from_file(spec: str, path: Path, name: str) -> type[Planner]:
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
    except (Exception, SystemExit) as error:
        why = f"{type(error).__name__}: {error}".replace("\n", " ")
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
