"""Progress of a run: a live bar on a terminal, plain lines in a pipe. On stderr."""

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from beacon_mj.cli.views.console import remark
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.progress import Update

LINE_S = 10.0  #: Time between two plain lines [s].


class Tally:
    """Episodes so far, successes so far, and the time that is left."""

    def __init__(self, total: int) -> None:
        """Count up to `total` episodes."""
        self.total = total
        self.before: int | None = None
        self.done = self.solved = 0
        self._began = time.monotonic()

    def add(self, rows: Sequence[Row]) -> None:
        """Count finished episodes; the first ones were finished before."""
        if self.before is None:
            self.before = len(rows)
        self.done += len(rows)
        self.solved += sum(row.success for row in rows)

    @property
    def success(self) -> str:
        """Share of successes so far, such as `93 % solved`."""
        if self.done == 0:
            return "none finished yet"
        return f"{100 * self.solved / self.done:.0f} % solved"

    @property
    def left(self) -> str:
        """Time left, such as `1:05 left`, by the pace so far."""
        if self.done == self.total:
            return "done"
        new = self.done - (self.before or 0)
        if new == 0:
            return "time left unknown"
        pace = (time.monotonic() - self._began) / new
        seconds = round(pace * (self.total - self.done))
        return f"{seconds // 60}:{seconds % 60:02d} left"

    def line(self) -> str:
        """Return one plain line."""
        return f"{self.done}/{self.total} episodes, {self.success}, {self.left}"


@contextmanager
def show_progress(name: str, total: int) -> Iterator[Update]:
    """Show how many episodes are done: a live bar on a terminal, else plain lines.

    Args:
        name: Of the part of a run that begins; empty for the whole.
        total: Its number of episodes.
    """
    if name:
        remark(f"{name}: {total} episodes")
    tally = Tally(total)
    with _bar(tally) if sys.stderr.isatty() else _lines(tally) as update:
        yield update


@contextmanager
def _lines(tally: Tally) -> Iterator[Update]:
    last = time.monotonic()

    def update(rows: Sequence[Row]) -> None:
        nonlocal last
        first = tally.before is None
        tally.add(rows)
        if first:
            return
        if time.monotonic() - last >= LINE_S or tally.done == tally.total:
            last = time.monotonic()
            remark(tally.line())

    yield update


@contextmanager
def _bar(tally: Tally) -> Iterator[Update]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    columns = (
        BarColumn(bar_width=None),
        MofNCompleteColumn(),
        TextColumn("{task.fields[success]}"),
        TextColumn("{task.fields[left]}"),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(
            "",
            total=tally.total,
            completed=0,
            success=tally.success,
            left=tally.left,
        )

        def update(rows: Sequence[Row]) -> None:
            tally.add(rows)
            bar.update(
                task, completed=tally.done, success=tally.success, left=tally.left
            )

        yield update
