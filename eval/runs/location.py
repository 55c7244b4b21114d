"""Where in a planner's code an episode failed, as `file:line`."""

import inspect
import sysconfig
import traceback
from pathlib import Path
from types import TracebackType

import beacon_mj
from beacon_mj.errors import one_line

#: Where Python's own library and this package lie; its links are followed.
_LIBRARIES = (
    Path(sysconfig.get_path("stdlib")).resolve(),
    *(
        (Path(beacon_mj.__file__).parent / name).resolve()
        for name in (".", "eval", "planners", "scene_gen")
    ),
)
_CAUSES = 100  #: Most exceptions that are followed to where they come from.


def location(error: BaseException) -> str:
    """Return `file:line` of the code that an error comes from.

    That is the innermost frame outside of this package and of installed ones, so that
    a planner's own line is named and not that of a library which it called; of an
    error from inside the package alone, the innermost frame. Empty if there is none:
    an exception may be a planner's own, and its causes may run in a circle.
    """
    try:
        found = [
            (frame.f_code.co_filename, line)
            for frame, line in traceback.walk_tb(_traceback(_root(error)))
        ]
        own = [place for place in found if not _is_library(Path(place[0]))]
        return _place(*(own or found)[-1]) if found else ""
    except Exception:
        return ""


def location_of(value: object, name: str) -> str:
    """Return `file:line` at which a method begins; empty if that is not known."""
    try:
        method = inspect.getattr_static(type(value), name)
        return _place(inspect.getfile(method), inspect.getsourcelines(method)[1])
    except Exception:
        return ""


def _root(error: BaseException) -> BaseException:
    """Return what an error was raised from, whatever its class says of itself."""
    for _ in range(_CAUSES):
        cause = BaseException.__dict__["__cause__"].__get__(error)
        if cause is None:
            break
        error = cause
    return error


def _traceback(error: BaseException) -> TracebackType | None:
    found: TracebackType | None = BaseException.__dict__["__traceback__"].__get__(error)
    return found


def _place(file: str, line: int) -> str:
    return f"{one_line(file)}:{line}"


def _is_library(path: Path) -> bool:
    if {"site-packages", "dist-packages"} & {*path.parts}:
        return True
    return any(path.resolve().is_relative_to(root) for root in _LIBRARIES)
