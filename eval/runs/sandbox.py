"""A planner that cannot harm more than its own episode."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, ClassVar

from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Oracle, Truth

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
    """

    Config: ClassVar[type[Any]] = dict

    def __init__(self, build: Callable[[], Planner], limit_s: float) -> None:
        """Guard the planner that `build` returns."""
        super().__init__({})
        self._build = build
        self._limit_s = limit_s

    def set_truth(self, truth: Truth) -> None:
        """Keep the truth until it is known who asks."""
        self._truth = truth

    def reset(self, task: Task) -> None:
        """Build the planner and reset it."""
        with _contained(RESET_LIMITS * self._limit_s):
            self._planner = self._build()
            if isinstance(self._planner, Oracle):
                self._planner.set_truth(self._truth)
            self._planner.reset(task)

    def act(self, observation: Observation) -> Command:
        """Ask the planner."""
        with _contained(self._limit_s):
            return self._planner.act(observation)


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
