"""What `beacon-mj replay --verify` does with a log or a folder of logs."""

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from beacon_mj.cli import FAILED
from beacon_mj.errors import LogError
from beacon_mj.eval.runs.verify import (
    logs_below,
    missing_logs,
    run_of,
    tables_of,
    verify_log,
    verify_logs,
)
from beacon_mj.recording.verify import Verification

LINE_S = 10.0  #: Time between two plain lines of progress [s].


def verify_path(path: Path, workers: int | None) -> int:
    """Verify a log, or all logs below a folder; return the exit status.

    Raises:
        BeaconError: If there is nothing to verify.
    """
    if not path.exists():
        raise LogError(f"{path}: cannot read the log: no such file or folder.")
    return _verify_folder(path, workers) if path.is_dir() else _verify_file(path)


def _verify_file(path: Path) -> int:
    run = run_of(path)
    tables = {} if run is None else tables_of(run)
    found = verify_log(path, tables)
    if not found.ok:
        _complain(found)
        return FAILED
    print(f"{path}: verified, {found.steps} steps and the row are the same bit for bit")
    if tables:
        print(f"the row is that of {' and '.join(tables)} in {run}")
    return 0


def _verify_folder(folder: Path, workers: int | None) -> int:
    """Print what failed as it is found, then a summary."""
    paths = logs_below(folder)
    failed = steps = 0
    with _progress(len(paths)) as advance:
        count = min(workers or os.cpu_count() or 1, len(paths))
        for found in verify_logs(paths, count):
            steps += found.steps
            failed += not found.ok
            advance(failed)
            if not found.ok:
                _complain(found)
    print(
        f"{len(paths) - failed} of {len(paths)} logs verified, {steps} steps "
        "simulated again"
    )
    _tell_what_is_not_there(folder, paths)
    return FAILED if failed else 0


def _tell_what_is_not_there(folder: Path, paths: list[Path]) -> None:
    """Say which tables were compared, and what left no log to verify."""
    runs = sorted({run for path in paths if (run := run_of(path)) is not None})
    for run in runs:
        missing = missing_logs(run)
        lacking = f"; {missing} of its rows have no log" if missing else ""
        print(f"rows compared with {' and '.join(tables_of(run))} in {run}{lacking}")
    if not runs:
        print("rows compared with no table: these logs lie in no run folder")
    if parts := sum(1 for _ in folder.rglob("*.mcap.part")):
        print(f"{parts} unfinished logs (*.mcap.part) were left out")


def _complain(found: Verification) -> None:
    print(f"error: {' '.join(str(found.problem).split())}", file=sys.stderr, flush=True)


@contextmanager
def _progress(total: int) -> Iterator[Callable[[int], None]]:
    """Show how many logs are done: a bar on a terminal, plain lines in a pipe."""
    if not sys.stderr.isatty():
        yield _lines(total)
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
        task = bar.add_task("", total=total, failed=0)
        yield lambda failed: bar.update(task, advance=1, failed=failed)


def _lines(total: int) -> Callable[[int], None]:
    done, began = 0, time.monotonic()
    last = began

    def advance(failed: int) -> None:
        nonlocal done, last
        done += 1
        now = time.monotonic()
        if now - last >= LINE_S or done == total:
            last = now
            left = round((now - began) / done * (total - done))
            print(
                f"{done}/{total} logs, {failed} failed, "
                f"{left // 60}:{left % 60:02d} left",
                file=sys.stderr,
                flush=True,
            )

    return advance
