"""Standard streams: results alone on stdout, and none that is missing or broken.

A planner, a layout, a library or a worker process may print. While a command runs, all
that goes to stderr, so that stdout holds the command's results and nothing else.
"""

import contextlib
import os
import sys
from collections.abc import Iterator
from contextvars import ContextVar
from typing import TextIO

_results: ContextVar[TextIO | None] = ContextVar("results", default=None)


def results() -> TextIO:
    """Return the stream of a command's results."""
    return _results.get() or sys.stdout


def open_missing() -> None:
    """Open the standard streams that the process was started without.

    Otherwise the next file that is opened takes the number of such a stream, and what
    is meant for the stream goes into that file.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            # The lowest number that is free, and so this one.
            os.open(os.devnull, os.O_RDONLY if number == 0 else os.O_WRONLY)
    sys.stdin = sys.stdin or open(0, encoding="utf-8", closefd=False)
    sys.stdout = sys.stdout or _writer(1)
    sys.stderr = sys.stderr or _writer(2)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


@contextlib.contextmanager
def results_on_stdout() -> Iterator[TextIO]:
    """Yield the stream of results, which has stdout for itself within the block.

    Raises:
        OSError: If the results could not be written, at the latest at the end.
    """
    own = sys.stdout is sys.__stdout__
    if own and _is_descriptor(sys.stdout, 1):
        with _own_descriptor() as stream, _told(stream):
            yield stream
        return
    with _told(sys.stdout) as stream, contextlib.redirect_stdout(sys.stderr):
        yield stream
        stream.flush()


def abandon(stream: TextIO) -> None:
    """Let a stream that cannot be written to any more lead nowhere.

    Otherwise what is left in its buffer is an error once more when the process ends.
    """
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


@contextlib.contextmanager
def _own_descriptor() -> Iterator[TextIO]:
    """Yield a stream to what stdout leads to; stdout leads to stderr meanwhile."""
    sys.stdout.flush()
    kept, usual = os.dup(1), sys.stdout
    stream = open(
        kept, "w", encoding=usual.encoding, errors="backslashreplace", closefd=False
    )
    os.dup2(2, 1)
    sys.stdout = _writer(1)
    try:
        yield stream
        stream.flush()
    except OSError:
        abandon(stream)
        raise
    finally:
        with contextlib.suppress(OSError, ValueError):
            sys.stdout.flush()
        sys.stdout = usual
        os.dup2(kept, 1)
        with contextlib.suppress(OSError):
            stream.close()
        os.close(kept)


@contextlib.contextmanager
def _told(stream: TextIO) -> Iterator[TextIO]:
    """Let `results` return a stream."""
    token = _results.set(stream)
    try:
        yield stream
    finally:
        _results.reset(token)


def _writer(number: int) -> TextIO:
    return open(
        number,
        "w",
        encoding="utf-8",
        errors="backslashreplace",
        buffering=1,
        closefd=False,
    )


def _is_descriptor(stream: TextIO, number: int) -> bool:
    try:
        return stream.fileno() == number
    except (OSError, ValueError):
        return False
