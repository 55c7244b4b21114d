"""What belongs to the whole process, put back after a planner has had its turn.

For planners that run in the evaluation's own process. It undoes what a planner does by
accident or habit; what a planner does on purpose takes a process of its own to hold,
see `beacon_mj.eval.runs.isolation`.
"""

import gc
import os
import signal
import sys
import threading
import warnings
from contextlib import suppress
from contextvars import copy_context
from typing import Any, TypeVar

T = TypeVar("T")


class ProcessState:
    """The state at the beginning of an episode.

    Decimal contexts, NumPy's error handling and other context variables are the
    planner's own: its calls share a context.
    """

    def __init__(self) -> None:
        """Take note of the state."""
        self._context = copy_context()
        self._folder = _folder()
        self._recursion = sys.getrecursionlimit()
        self._warnings = list(warnings.filters)
        self._streams = sys.stdin, sys.stdout, sys.stderr
        self._environment = dict(os.environ)
        self._collecting = gc.isenabled()
        self._handlers = _handlers()
        self._mask = _mask()

    def run(self, call: Any, *arguments: Any) -> Any:
        """Call a planner, then put back what the episode itself depends on."""
        try:
            return self._context.run(call, *arguments)
        finally:
            if sys.getrecursionlimit() != self._recursion:
                sys.setrecursionlimit(self._recursion)
            if self._folder is not None and _folder() != self._folder:
                with suppress(OSError):
                    os.chdir(self._folder)
            if warnings.filters != self._warnings:
                _set_filters(self._warnings)

    def restore(self) -> None:
        """Put back everything, at the end of the episode."""
        self.run(int)
        sys.stdin, sys.stdout, sys.stderr = self._streams
        if self._mask is not None:
            os.umask(self._mask)
        if os.environ != self._environment:
            os.environ.clear()
            os.environ.update(self._environment)
        if gc.isenabled() != self._collecting:
            (gc.enable if self._collecting else gc.disable)()
        for number, handler in self._handlers.items():
            if signal.getsignal(number) is not handler:
                signal.signal(number, handler)


def _folder() -> str | None:
    try:
        return os.getcwd()
    except OSError:
        return None


def _handlers() -> dict[int, Any]:
    """Return the handlers of the signals that stop a run; only the main thread's."""
    if not _in_main_thread():
        return {}
    found = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}
    return {int(n): handler for n, handler in found.items() if handler is not None}


def _mask() -> int | None:
    """Return the mask of new files. To read it is to set it: in one thread only."""
    if not _in_main_thread():
        return None
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


def _set_filters(filters: list[Any]) -> None:
    """Replace the filters of warnings, and let the interpreter know."""
    warnings.filters[:] = filters  # type: ignore[index]
    with warnings.catch_warnings():
        pass  # Both ways through it drop what was cached for the old filters.
