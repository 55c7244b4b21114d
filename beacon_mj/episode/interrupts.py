"""What may stop a planner from outside: the user, and a time limit.

A planner can raise anything, `KeyboardInterrupt` included. What the user asked for is
told apart by what a signal's handler noted. Signals reach the main thread only:
elsewhere nothing here does anything.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_WAVES_S = 0.05  #: Time between two alarms, should the first be swallowed [s].


class Overdue(BaseException):
    """A call exceeds its time limit; not an Exception, so that few swallow it."""


class _State:
    """Of the main thread."""

    watching = False
    stop: BaseException | None = None
    armed = False


def raise_if_stopped() -> None:
    """Raise what the user's Ctrl-C or SIGTERM raised, should somebody have caught it.

    Only below `watched`.
    """
    if _State.stop is not None and _in_main_thread():
        raise _State.stop


def outer_limit() -> bool:
    """Whether a time limit is running, of this call or of one around it."""
    return _State.armed and _in_main_thread()


@contextmanager
def watched() -> Iterator[None]:
    """Take note of Ctrl-C and SIGTERM in the body; their handlers do what they did."""
    if _State.watching or not _in_main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    mine = {n: _noting(h) for n, h in before.items() if callable(h)}
    _State.watching, _State.stop = True, None
    try:
        for number, handler in mine.items():
            signal.signal(number, handler)
        yield
    finally:
        for number in mine:
            signal.signal(number, before[number])
        _State.watching, _State.stop = False, None


def _noting(handler: Callable[..., Any]) -> Callable[[int, FrameType | None], None]:
    def note(signum: int, frame: FrameType | None) -> None:
        try:
            handler(signum, frame)
        except BaseException as stop:
            _State.stop = stop
            raise

    return note


@contextmanager
def time_limit(limit_s: float) -> Iterator[None]:
    """Raise `Overdue` in the body, again and again, once `limit_s` is over.

    One limit at a time: the body of another one does not set its own. Where the system
    has no interval timers, and against compiled code, this does nothing; a planner in
    a process of its own is ended from outside.
    """
    if _State.armed or not (_in_main_thread() and hasattr(signal, "setitimer")):
        yield
        return
    before = signal.signal(signal.SIGALRM, _raise_overdue)
    _State.armed = True
    try:
        signal.setitimer(signal.ITIMER_REAL, limit_s, _WAVES_S)
        yield
    finally:
        _disarm(before)


def _disarm(before: Any) -> None:
    while True:
        try:
            _State.armed = False
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)
            return
        except Overdue:
            continue  # One last alarm came in between.


def _raise_overdue(signum: int, frame: FrameType | None) -> None:
    if _State.armed:
        raise Overdue


def _in_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()
