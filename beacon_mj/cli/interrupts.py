"""SIGTERM, as batch systems send it before their time limit, ends a run like Ctrl-C."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from beacon_mj.cli import INTERRUPTED

TERMINATED = 128 + signal.SIGTERM


class Terminated(KeyboardInterrupt):
    """The process was asked to end."""


@contextmanager
def terminable() -> Iterator[None]:
    """Raise `Terminated` in the body when SIGTERM comes."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def status_of(stop: KeyboardInterrupt) -> int:
    """Return the exit status: 130 after Ctrl-C, 143 after SIGTERM."""
    return TERMINATED if isinstance(stop, Terminated) else INTERRUPTED


def _terminate(signum: int, frame: FrameType | None) -> None:
    raise Terminated
