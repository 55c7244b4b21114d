"""A planner that cannot harm more than its own episode."""

import signal
import sysconfig
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any, ClassVar

import beacon_mj
from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Oracle, Truth

#: Where Python's own library and this package lie; its links are followed.
_LIBRARIES = (
    Path(sysconfig.get_path("stdlib")).resolve(),
    *(
        (Path(beacon_mj.__file__).parent / name).resolve()
        for name in (".", "eval", "planners", "scene_gen")
    ),
)

#: Limits that a reset may take: compiling a planner's kernels is no decision.
RESET_LIMITS = 20


class _Overdue(BaseException):
    """A decision exceeds its time limit; not an Exception, so none swallows it."""


class Guarded(Oracle):
    """Builds a planner for each episode and turns whatever it does into an Exception.

    `run_episode` makes a `planner_error` of that. A decision that does not end is
    interrupted after `limit_s` where the system has interval timers and this is the
    main thread; elsewhere it is judged when it ends. The truth about a world is passed
    on to oracles and to no other planner.

    Attributes:
        where: File and line at which the planner failed; empty if it has not.
    """

    Config: ClassVar[type[Any]] = dict

    def __init__(self, build: Callable[[], Planner], limit_s: float) -> None:
        """Guard the planner that `build` returns."""
        super().__init__({})
        self._build = build
        self._limit_s = limit_s
        self.where = ""

    def set_truth(self, truth: Truth) -> None:
        """Keep the truth until it is known who asks."""
        self._truth = truth

    def reset(self, task: Task) -> None:
        """Build the planner and reset it."""
        try:
            with _contained(RESET_LIMITS * self._limit_s):
                self._planner = self._build()
                if isinstance(self._planner, Oracle):
                    self._planner.set_truth(self._truth)
                self._planner.reset(task)
        except Exception as error:
            self.where = location(error)
            raise

    def act(self, observation: Observation) -> Command:
        """Ask the planner."""
        try:
            with _contained(self._limit_s):
                return self._planner.act(observation)
        except Exception as error:
            self.where = location(error)
            raise


def location(error: BaseException) -> str:
    """Return `file:line` of the code that an error comes from.

    That is the innermost frame outside of this package and of installed ones, so that
    a planner's own line is named and not that of a library which it called; of an
    error from inside the package alone, the innermost frame.
    """
    while error.__cause__ is not None:
        error = error.__cause__
    frames = traceback.extract_tb(error.__traceback__)
    if not frames:
        return ""
    own = [f for f in frames if not _is_library(Path(f.filename))]
    found = (own or frames)[-1]
    return f"{found.filename}:{found.lineno}"


def _is_library(path: Path) -> bool:
    if {"site-packages", "dist-packages"} & {*path.parts}:
        return True
    return any(path.resolve().is_relative_to(root) for root in _LIBRARIES)


@contextmanager
def _contained(limit_s: float) -> Iterator[None]:
    """Turn an exit of the interpreter, or a time limit, into an error."""
    try:
        with _alarm(limit_s):
            yield
    except SystemExit as error:
        raise RuntimeError("the planner tried to end the process") from error
    except _Overdue as error:
        raise TimeoutError(f"no decision within {limit_s:g} s") from error


@contextmanager
def _alarm(limit_s: float) -> Iterator[None]:
    main = threading.current_thread() is threading.main_thread()
    if not (main and hasattr(signal, "setitimer")):
        yield
        return
    before = signal.signal(signal.SIGALRM, _overdue)
    signal.setitimer(signal.ITIMER_REAL, limit_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _overdue(signum: int, frame: FrameType | None) -> None:
    raise _Overdue
