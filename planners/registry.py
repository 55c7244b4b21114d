"""Planners by name. A built-in one is imported when it is asked for, not before."""

import hashlib
import importlib
import inspect
import os
import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from beacon_mj.errors import PlannerError, describe, unknown
from beacon_mj.planners.base import Planner
from beacon_mj.planners.program import is_program, whole_program
from beacon_mj.regular_files import read_regular

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
OURS = {
    "beacon-kinds": "beacon_mj.planners.beacon_kinds:BeaconKinds",
    "beacon-voi": "beacon_mj.planners.beacon_voi:BeaconVoi",
}
#: Reference planners: beside the table, never in it. `clairvoyant` is told the truth;
#: `ctp-optimist`, `ctp-hindsight` and `belief-dp` the route graph and its prior.
REFERENCE = {
    "impact": "beacon_mj.planners.impact:Impact",
    "mppi": "beacon_mj.planners.mppi:Mppi",
    "namo": "beacon_mj.planners.namo:Namo",
    "ppo": "beacon_mj.planners.ppo:Ppo",
    "push-through": "beacon_mj.planners.push_through:PushThrough",
    "ctp-optimist": "beacon_mj.planners.ctp_optimist:CtpOptimist",
    "ctp-hindsight": "beacon_mj.planners.ctp_hindsight:CtpHindsight",
    "belief-dp": "beacon_mj.planners.belief_dp:BeliefDp",
    "clairvoyant": "beacon_mj.planners.clairvoyant:Clairvoyant",
}
ALIASES = {"bug": "bug1"}
MAX_BYTES = 16_000_000  #: Of a planner's file.


def planner_names() -> dict[str, str]:
    """Return `module:Class` of every planner by name.

    A third party's planner cannot take the name of a built-in one.
    """
    third = {e.name: e.value for e in entry_points(group=GROUP)}
    return third | _shipped()


def _shipped() -> dict[str, str]:
    return PAPER | OURS | REFERENCE


def is_shipped(spec: str) -> bool:
    """Whether a planner is one of this package, and no third party's."""
    return spec in _shipped()


def file_planner(spec: str) -> str | None:
    """Return the class that `path/to/file.py:ClassName` names; None for others."""
    if is_program(spec):
        return None
    path, _, member = spec.rpartition(":")
    return member if path.endswith(".py") else None


def whole_spec(spec: str) -> str:
    """Return a spec that means the same planner in every folder."""
    if is_program(spec):
        return whole_program(spec)
    path, colon, member = spec.rpartition(":")
    return f"{Path(path).resolve()}{colon}{member}" if path.endswith(".py") else spec


def load_planner(spec: str) -> tuple[str, type[Planner]]:
    """Return name and class of the planner that `spec` stands for.

    Args:
        spec: A name, an alias, or `path/to/file.py:ClassName`, whose name is the
            class's.

    Raises:
        PlannerError: If there is no such planner, or it is no complete `Planner`.
    """
    if is_program(spec):
        raise PlannerError(
            f"{spec}: expected a planner with a class but this is a program."
        )
    path, _, member = spec.rpartition(":")
    if path.endswith(".py"):
        return member, _from_file(spec, Path(path), member)
    name, known = ALIASES.get(spec, spec), _shipped()
    if name not in known:
        known = planner_names()  # Reads the metadata of all that is installed.
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
    try:
        module = _file_module(path.resolve())
    except (ImportError, OSError) as error:
        raise PlannerError(f"{path}: cannot be imported: {error}.") from error
    return _member(spec, module, name)


def _file_module(path: Path) -> ModuleType:
    """Return the module of a file, executed once for each path and content.

    It belongs to a package of its own, so that two files of one name stay apart, and
    stays in `sys.modules`, where pickling and dataclasses look for it.

    Raises:
        ImportError: Whatever the file raises, but for Ctrl-C.
    """
    source = read_regular(path, MAX_BYTES)
    digest = hashlib.sha256(os.fsencode(path) + b"\0" + source).hexdigest()
    package = f"beacon_mj_planner_{digest[:16]}"
    name = f"{package}.{path.stem}"
    if name in sys.modules:
        return sys.modules[name]
    module = ModuleType(name)
    module.__file__, module.__package__ = str(path), package
    parent = ModuleType(package)
    parent.__path__ = [str(path.parent)]
    sys.modules.update({package: parent, name: module})
    try:
        with _Neighbours(package, path.parent):
            exec(compile(source, path, "exec", dont_inherit=True), vars(module))
    except BaseException as error:
        for known in [n for n in sys.modules if n.startswith(package)]:
            del sys.modules[known]
        if isinstance(error, KeyboardInterrupt):
            raise
        raise ImportError(describe(error)) from error
    return module


class _Neighbours(MetaPathFinder, Loader):
    """Finds the modules beside a planner's file while that is executed.

    `import helper` takes `helper.py` of the same folder into the package of the file,
    where `from . import helper` finds it at any time. Nothing of the standard library
    is hidden.
    """

    def __init__(self, package: str, folder: Path) -> None:
        self._package, self._folder = package, folder
        self._specs: dict[str, ModuleSpec | None] = {}

    def __enter__(self) -> None:
        importlib.invalidate_caches()
        sys.meta_path.insert(0, self)

    def __exit__(self, *_: object) -> None:
        sys.meta_path.remove(self)
        for name in self._specs:
            sys.modules.pop(name, None)

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: object = None
    ) -> ModuleSpec | None:
        """Return where a module beside the file comes from, else None."""
        if path is not None or fullname in sys.stdlib_module_names:
            return None
        beside = (self._folder / f"{fullname}.py").is_file()
        return ModuleSpec(fullname, self) if beside else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module under its name in the file's package."""
        module = importlib.import_module(f"{self._package}.{spec.name}")
        self._specs.setdefault(spec.name, module.__spec__)
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give the module, which was executed as it was created, its own spec back."""
        if module.__spec__ is not None:
            module.__spec__ = self._specs[module.__spec__.name]


def _member(spec: str, module: ModuleType, name: str) -> type[Planner]:
    found: object = getattr(module, name, None)
    if not (inspect.isclass(found) and issubclass(found, Planner)):
        planners = [n for n, value in vars(module).items() if _is_planner(value)]
        raise PlannerError(f"{spec}: {unknown('planner class', name, planners)}")
    if missing := found.missing():
        raise PlannerError(
            f"{spec}: expected a complete planner but it lacks {', '.join(missing)}."
        )
    return found


def _is_planner(value: object) -> bool:
    """Whether a value is a planner that can be built."""
    return inspect.isclass(value) and issubclass(value, Planner) and not value.missing()
