"""What may stop a planner from outside: the user, and a time limit.

A planner can raise anything, `KeyboardInterrupt` included. What the user asked for is
told apart by what a signal's handler noted. Signals reach the main thread only:
elsewhere nothing here does anything.
"""

import math
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_TICK_S = 0.05  #: Time between two looks at whether a call is overdue [s].


class Overdue(BaseException):
    """A call exceeds its time limit; not an Exception, so that few swallow it."""


class _State:
    """Of the main thread."""

    watching = False
    stop: BaseException | None = None
    deadline_s = math.inf


@contextmanager
def watched() -> Iterator[None]:
    """Watch over the calls in the body: the user's signals, and time limits.

    Handlers of Ctrl-C and SIGTERM do what they did. A timer of the system ticks all the
    time, where it has one: setting one for each call would cost more than most calls.
    """
    if _State.watching or not _in_main_thread():
        yield
        return
    handlers: dict[signal.Signals, Any] = {}
    for number in _SIGNALS:
        if callable(handler := signal.getsignal(number)):
            handlers[number] = _noting(handler)
    if hasattr(signal, "setitimer"):
        handlers[signal.SIGALRM] = _tick
    before = {number: signal.getsignal(number) for number in handlers}
    _State.watching, _State.stop = True, None
    try:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if signal.SIGALRM in handlers:
            signal.setitimer(signal.ITIMER_REAL, _TICK_S, _TICK_S)
        yield
    finally:
        if signal.SIGALRM in handlers:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, old in before.items():
            signal.signal(number, old)
        _State.watching, _State.stop = False, None


def raise_if_stopped() -> None:
    """Raise what Ctrl-C or SIGTERM raised, should somebody have caught it."""
    if _State.stop is not None and _in_main_thread():
        raise _State.stop


def begin_limit(limit_s: float) -> bool:
    """Have `Overdue` raised, again and again, once `limit_s` is over.

    Only below `watched`; and compiled code is not interrupted: a planner in a process
    of its own is ended from outside.

    Returns:
        Whether this is the outermost limit, which `end_limit` must end; a limit inside
        of another one is not set.
    """
    if _State.deadline_s < math.inf or not _in_main_thread():
        return False
    _State.deadline_s = time.monotonic() + limit_s
    return True


def end_limit() -> None:
    """End the outermost time limit."""
    _State.deadline_s = math.inf


def limited() -> bool:
    """Whether a time limit is running."""
    return _State.deadline_s < math.inf and _in_main_thread()


def _tick(signum: int, frame: FrameType | None) -> None:
    if time.monotonic() > _State.deadline_s:
        raise Overdue


def _noting(handler: Callable[..., Any]) -> Callable[[int, FrameType | None], None]:
    def note(signum: int, frame: FrameType | None) -> None:
        try:
            handler(signum, frame)
        except BaseException as stop:
            _State.stop = stop
            raise

    return note


def _in_main_thread() -> bool:
    return threading.get_ident() == threading.main_thread().ident
