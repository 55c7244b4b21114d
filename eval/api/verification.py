"""Verifying a log, or every log of a run."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from beacon_mj.errors import LogError
from beacon_mj.eval.runs.verify import (
    logs_below,
    missing_logs,
    run_of,
    tables_of,
    verify_log,
    verify_logs,
)
from beacon_mj.eval.runs.worker_process import usable_cores
from beacon_mj.eval.statistics.results import Results
from beacon_mj.files import files_below
from beacon_mj.recording.verify import Verification


@dataclass(frozen=True, kw_only=True, slots=True)
class Verified:
    """What came of verifying a log or a run.

    Attributes:
        path: The log or folder.
        logs: What came of each log, in the order of their paths.
        remarks: Which tables were compared, and what left no log to verify.
    """

    path: Path
    logs: tuple[Verification, ...]
    remarks: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether every log proves its own numbers."""
        return not self.problems

    @property
    def problems(self) -> list[str]:
        """A line for each log that does not."""
        return [_line(log) for log in self.logs if not log.ok]

    @property
    def steps(self) -> int:
        """Control steps that were simulated again."""
        return sum(log.steps for log in self.logs)

    def __str__(self) -> str:
        """Return how many logs were verified, and the remarks."""
        return "\n".join([self._verdict(), *self.remarks])

    def _verdict(self) -> str:
        good = sum(log.ok for log in self.logs)
        if self.path.is_dir():
            return (
                f"{good} of {len(self.logs)} logs verified, {self.steps} steps "
                "simulated again"
            )
        if not good:
            return f"{self.path}: not verified"
        return (
            f"{self.path}: verified, {self.steps} steps and the row are the same bit "
            "for bit"
        )


def verify(
    target: Results | str | Path,
    *,
    workers: int | None = None,
    on_log: Callable[[Verification, int], None] = lambda _, total: None,
) -> Verified:
    """Simulate logged episodes again, and compare every state and row bit for bit.

    The same as `beacon-mj verify`. The stored row of an episode is also compared with
    the tables of its run.

    Args:
        target: A log, a folder with logs below it, or results.
        workers: Processes; by default one per usable core.
        on_log: Told what came of each log as it is done, in any order, and how many
            logs there are.

    Raises:
        BeaconError: If there is nothing to verify.
    """
    path = target.folder if isinstance(target, Results) else Path(target)
    if not path.exists():
        raise LogError(f"{path}: cannot read the log: no such file or folder.")
    if not path.is_dir():
        return _verified_log(path, on_log)
    paths = logs_below(path)
    count = min(workers or usable_cores(), len(paths))
    found = []
    for each in verify_logs(paths, count):
        found.append(each)
        on_log(each, len(paths))
    return Verified(
        path=path,
        logs=tuple(sorted(found, key=lambda log: log.path)),
        remarks=tuple(_remarks(path, paths)),
    )


def _verified_log(path: Path, on_log: Callable[[Verification, int], None]) -> Verified:
    run = run_of(path)
    tables = {} if run is None else tables_of(run)
    found = verify_log(path, tables)
    on_log(found, 1)
    remarks = [f"the row is that of {' and '.join(tables)} in {run}"]
    told = remarks if tables and found.ok else []
    return Verified(path=path, logs=(found,), remarks=tuple(told))


def _remarks(folder: Path, paths: list[Path]) -> Iterator[str]:
    """Yield which tables were compared, and what left no log to verify."""
    runs = sorted({run for path in paths if (run := run_of(path)) is not None})
    for run in runs:
        missing = missing_logs(run)
        lacking = f"; {missing} of its rows have no log" if missing else ""
        yield f"rows compared with {' and '.join(tables_of(run))} in {run}{lacking}"
    if not runs:
        yield "rows compared with no table: these logs lie in no run folder"
    if parts := len(files_below(folder, ".mcap.part")):
        yield f"{parts} unfinished logs (*.mcap.part) were left out"


def _line(log: Verification) -> str:
    return " ".join(str(log.problem).split())
