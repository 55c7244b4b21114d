"""Layouts of one's own: from a template folder's `layouts.py`, or an entry point.

The file runs when a family of its folder is used, in every process anew. What it
registers stays with the file: two folders may both call a layout `ring`.
"""

import functools
import hashlib
import sys
import traceback
from importlib.metadata import EntryPoint
from pathlib import Path
from types import ModuleType

import beacon_mj.scene_gen.warehouse  # noqa: F401  It registers its layout.
from beacon_mj.errors import BeaconError, TemplateError, unknown
from beacon_mj.scene import Obstacle
from beacon_mj.scene_gen.family import Family
from beacon_mj.scene_gen.layout_sources import (
    GROUP,
    layout_entry_point,
    layout_file,
    module_file,
    read_source,
)
from beacon_mj.scene_gen.layouts import (
    LAYOUTS,
    Layout,
    NoRoomError,
    Point,
    registering,
)
from beacon_mj.scene_gen.learning.layouts import LEARNING_LAYOUTS
from beacon_mj.scene_gen.sampling import Sampler
from beacon_mj.scene_gen.template_paths import template_folder


def find_layout(family: Family) -> Layout:
    """Return the layout that a family names.

    It may be a shipped one, one of `layouts.py` in the family's template folder, or an
    entry point of the group `beacon_mj.layouts`; the first of them that has the name.

    Raises:
        TemplateError: If there is none of that name, or its file cannot be imported.
    """
    name, path = family.layout, _own_file(family)
    own = {} if path is None else _run(path, read_source(path))
    if name in LAYOUTS:
        return LAYOUTS[name]
    if path is not None and name in own:
        return _guarded(own[name], path)
    found = layout_entry_point(name)
    if found is not None:
        return _guarded(_loaded(found), module_file(found) or Path(found.value))
    known = [*LAYOUTS, *LEARNING_LAYOUTS, *own]
    raise TemplateError(f"{family.source}: {unknown('layout', name, known)}")


def check_layout(family: Family) -> None:
    """Check that there is a layout of the name that a family gives, of any sort.

    Raises:
        TemplateError: If there is none of that name, or its file cannot be imported.
    """
    if family.layout not in LEARNING_LAYOUTS:
        find_layout(family)
    elif (path := _own_file(family)) is not None:
        _run(path, read_source(path))


def _own_file(family: Family) -> Path | None:
    """Return the layouts of the family's template folder, if it has any."""
    path = layout_file(template_folder(family.source))
    return None if path is None else path.resolve()


@functools.lru_cache(maxsize=32)
def _run(path: Path, source: bytes) -> dict[str, Layout]:
    """Run a file of layouts; one that was edited since is run again."""
    digest = hashlib.sha256(str(path).encode() + b"\0" + source).hexdigest()
    module = ModuleType(f"beacon_mj_layouts_{digest[:16]}")
    module.__file__ = str(path)
    found: dict[str, Layout] = {}
    sys.modules[module.__name__] = module  # Dataclasses look their module up.
    try:
        with registering(found):
            exec(compile(source, path, "exec"), module.__dict__)
    except (Exception, SystemExit) as error:
        sys.modules.pop(module.__name__, None)
        raise _located(error, path, "cannot import the layouts") from error
    shadowing = sorted((LAYOUTS.keys() | LEARNING_LAYOUTS.keys()) & found.keys())
    if shadowing:
        raise TemplateError(
            f"{path}: expected layouts to have names of their own but "
            f"{shadowing[0]!r} is shipped."
        )
    return found


def _loaded(found: EntryPoint) -> Layout:
    try:
        with registering({}):
            function: Layout = found.load()
    except Exception as error:
        raise TemplateError(
            f"entry point {found.value!r} of {GROUP}: cannot be loaded: {_words(error)}"
        ) from error
    return function


def _guarded(function: Layout, path: Path) -> Layout:
    """Return the layout with its mistakes as errors of one line."""

    def placed(sampler: Sampler, start: Point, goal: Point) -> list[Obstacle]:
        try:
            found = function(sampler, start, goal)
        except (BeaconError, NoRoomError):
            raise
        except Exception as error:
            raise _located(error, path, "the layout failed") from error
        if not isinstance(found, list) or not all(
            isinstance(o, Obstacle) for o in found
        ):
            raise TemplateError(
                f"{path}: expected the layout to return a list of obstacles but it "
                f"was {type(found).__name__}."
            )
        return found

    return placed


def _located(error: BaseException, path: Path, what: str) -> TemplateError:
    """Return the error in one line that names the line of the file."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [f.lineno for f in frames if f.filename == str(path)]
    line = lines[-1] if lines else None
    if isinstance(error, SyntaxError) and error.filename == str(path):
        line = error.lineno
    where = f"{path}" if line is None else f"{path}:{line}"
    return TemplateError(f"{where}: {what}: {_words(error)}")


def _words(error: BaseException) -> str:
    text = error.msg if isinstance(error, SyntaxError) else str(error)
    return " ".join(f"{type(error).__name__}: {text}".split())
