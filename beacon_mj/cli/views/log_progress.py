"""Progress of verifying logs: a bar on a terminal, plain lines in a pipe."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from beacon_mj.cli.views.console import complain, remark
from beacon_mj.recording.verify import Verification

LINE_S = 10.0  #: Time between two plain lines of progress [s].


@contextmanager
def show_logs() -> Iterator[Callable[[Verification, int], None]]:
    """Yield what is told of each verified log; a log that fails is printed at once."""
    lines = _Lines()
    if not sys.stderr.isatty():
        yield lines.add
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        BarColumn(bar_width=None),
        MofNCompleteColumn(),
        TextColumn("{task.fields[failed]} failed"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=None, failed=0)

        def add(log: Verification, total: int) -> None:
            lines.count(log)
            bar.update(task, advance=1, total=total, failed=lines.failed)

        yield add


class _Lines:
    """Counts logs, and prints a line every few seconds."""

    def __init__(self) -> None:
        self.done = self.failed = 0
        self._began = self._last = time.monotonic()

    def count(self, log: Verification) -> None:
        self.done += 1
        if not log.ok:
            self.failed += 1
            complain([str(log.problem)])

    def add(self, log: Verification, total: int) -> None:
        self.count(log)
        now = time.monotonic()
        if total > 1 and (now - self._last >= LINE_S or self.done == total):
            self._last = now
            left = round((now - self._began) / self.done * (total - self.done))
            remark(
                f"{self.done}/{total} logs, {self.failed} failed, "
                f"{left // 60}:{left % 60:02d} left"
            )
