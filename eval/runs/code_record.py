"""The record of the files that decide a result: planners' code, and their data.

A planner's file is read, never run, to make the record. Of a program these are the
files that its command names. Built-in planners are part of the package, whose source
has one digest among the versions. Data is what settings name, such as a network's
weights.
"""

import importlib.util
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

import msgspec

from beacon_mj.errors import PlannerError, RunError
from beacon_mj.eval.runs.config import PlannerEntry, RunConfig
from beacon_mj.planners.base import Planner
from beacon_mj.planners.program import is_program, program_files, whole_program
from beacon_mj.planners.registry import file_planner, planner_names
from beacon_mj.regular_files import read_regular
from beacon_mj.scene_gen.layout_sources import layout_file
from beacon_mj.source_files import digests, first_change, local_sources

MAX_DATA_BYTES = 200_000_000  #: Of a file that a setting names.


def planner_file(spec: str) -> Path | None:
    """Return the whole path of the file that a planner is loaded from, if it is one."""
    if file_planner(spec) is None:
        return None
    return Path(spec.rpartition(":")[0]).resolve()


def home_of(spec: str) -> str:
    """Return where a planner is from: a file's whole path, or a program's command."""
    if is_program(spec):
        return whole_program(spec)
    file = planner_file(spec)
    return "" if file is None else str(file)


def code_of(spec: str, cls: type[Planner] | None = None) -> dict[str, str]:
    """Return the SHA-256 of a planner's file and of the local modules it imports.

    Args:
        spec: What the planner is loaded by.
        cls: The class that was handed over, if it was.

    Returns:
        Digests by path below the file's folder; below that of its package, for a
        planner of an installed one; by name for a program's. Nothing for the package's
        own planners, and for classes without a file.

    Raises:
        PlannerError: If a file cannot be read.
    """
    found = None if is_program(spec) else _sources(spec, cls)
    try:
        if is_program(spec):
            return digests(_program_code(spec))
        return {} if found is None else digests(local_sources(*found))
    except FileNotFoundError as error:
        raise PlannerError(
            f"{error.filename}: expected a Python file but there is none."
        ) from error
    except OSError as error:
        raise PlannerError(
            f"{error.filename}: cannot read the planner's file: {error.strerror}."
        ) from error


def data_of(settings: Mapping[str, str]) -> dict[str, str]:
    """Return the SHA-256 of each file that settings name, by the name they give it.

    Raises:
        PlannerError: If a file cannot be read.
    """
    try:
        named = {text: Path(text) for text in settings.values() if _is_file(text)}
        return digests({k: read_regular(p, MAX_DATA_BYTES) for k, p in named.items()})
    except OSError as error:
        raise PlannerError(
            f"{error.filename}: cannot read the file that a setting names: "
            f"{error.strerror}."
        ) from error


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except (OSError, ValueError):  # Too long for a path, or a null byte in it.
        return False


def as_it_is(entry: PlannerEntry) -> PlannerEntry:
    """Return a planner with the code and the data that its files hold now.

    The code of a class that was handed over in Python stays as it is: no spec leads
    to it.

    Raises:
        PlannerError: If a file cannot be read.
    """
    named = {*entry.settings.values()}
    kept = {name: sha for name, sha in entry.code.items() if name not in named}
    code = code_of(entry.loaded_from) or kept
    return msgspec.structs.replace(entry, code=code | data_of(entry.settings))


def check_code(entries: Iterable[PlannerEntry]) -> None:
    """Check that planners' files are still those that the run was started with.

    Raises:
        RunError: If one was edited, naming it.
        PlannerError: If one is not there any more.
    """
    for entry in entries:
        if not entry.code:
            continue
        if change := first_change(entry.code, as_it_is(entry).code):
            raise RunError(
                f"{entry.home or entry.name}: expected the code and the data that the "
                f"run was started with but {change}. Every episode of a run is of the "
                "same."
            )


def named_code(config: RunConfig) -> list[str]:
    """Return the files and programs that a run names and whose code would run."""
    found = [home_of(entry.loaded_from) for entry in config.planners]
    found.append(str(named_layouts(config) or ""))
    return [*dict.fromkeys(each for each in found if each)]


def named_layouts(config: RunConfig) -> Path | None:
    """Return the layouts that generating a run's scenes would run, if it has any."""
    if config.scene_dir is not None or config.templates is None:
        return None
    return layout_file(Path(config.templates))


def check_trusted(config: RunConfig, trust_code: bool, otherwise: str = "") -> None:
    """Refuse to run code that only a folder names, unless the user said so.

    Raises:
        RunError: Naming the files.
    """
    named = named_code(config)
    if named and not trust_code:
        raise RunError(
            f"Expected --trust-code, because this would run {', '.join(named)}, which "
            f"the run names and may come from a stranger.{otherwise}"
        )


Sources = tuple[Path, Path, str | None]  #: See `local_sources`.


def code_files(entry: PlannerEntry) -> dict[str, bytes]:
    """Return the files of a planner's record; empty for a class handed over in Python.

    Raises:
        OSError: If one cannot be read.
    """
    if is_program(entry.spec):
        return _program_code(entry.loaded_from)
    found = _sources(entry.loaded_from, None)
    return {} if found is None else local_sources(*found)


def _program_code(spec: str) -> dict[str, bytes]:
    return {name: path.read_bytes() for name, path in program_files(spec).items()}


def _sources(spec: str, cls: type[Planner] | None) -> Sources | None:
    """Return the file of a planner, and which modules are its own."""
    if (file := planner_file(spec)) is not None:
        return file, file.parent, None
    if cls is not None:
        module = cls.__module__
    else:
        module = planner_names().get(spec, "").partition(":")[0]
    top = module.partition(".")[0]
    if top in ("", "beacon_mj"):
        return None
    found = _packaged(module) if top != "__main__" else None
    return found or _single(module)


def _packaged(module: str) -> Sources | None:
    """Return the file of a module of a package, not importing it."""
    top, *rest = module.split(".")
    try:
        spec = importlib.util.find_spec(top)
    except (ImportError, ValueError):
        return None
    if spec is None or not spec.submodule_search_locations:
        return None
    root = Path(next(iter(spec.submodule_search_locations)))
    below = root.joinpath(*rest)
    file = below / "__init__.py" if below.is_dir() else below.with_suffix(".py")
    return (file, root.parent, top) if file.is_file() else None


def _single(module: str) -> Sources | None:
    """Return the file of a script, or of a module that is no package."""
    path = getattr(sys.modules.get(module), "__file__", None)
    if path is None:
        try:
            spec = importlib.util.find_spec(module)
        except (ImportError, ValueError):
            return None
        path = None if spec is None else spec.origin
    if path is None or not Path(path).is_file():
        return None
    installed = {"site-packages", "dist-packages"} & {*Path(path).parts}
    return Path(path), Path(path).parent, module if installed else None
