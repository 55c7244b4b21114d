"""Verifying a log, or every log of a run."""

import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from beacon_mj.errors import LogError, RunError
from beacon_mj.eval.runs.run_folder import CONFIG
from beacon_mj.eval.runs.verify import (
    logs_below,
    missing_logs,
    run_of,
    tables_of,
    verify_log,
    verify_logs,
)
from beacon_mj.eval.runs.whole_numbers import check_whole_numbers
from beacon_mj.eval.runs.worker_process import usable_cores
from beacon_mj.eval.statistics.results import Results
from beacon_mj.eval.verification.bundle import write_bundle
from beacon_mj.eval.verification.checks import Check
from beacon_mj.eval.verification.rates import FreshResult
from beacon_mj.eval.verification.run import Asked, check_run
from beacon_mj.eval.verification.unpack import is_bundle, relocated, unpack
from beacon_mj.files import files_below
from beacon_mj.recording.verify import Verification


@dataclass(frozen=True, kw_only=True, slots=True)
class Verified:
    """What came of verifying a log or a run.

    Attributes:
        path: The log or folder.
        logs: What came of each log, in the order of their paths.
        remarks: Which tables were compared, and what left no log to verify.
        checks: What came of each level, for each run; see docs/verification.md.
        fresh: What planners claim, and what they do on fresh scenes.
    """

    path: Path
    logs: tuple[Verification, ...]
    remarks: tuple[str, ...]
    checks: tuple[Check, ...] = ()
    fresh: tuple[FreshResult, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether every log proves its own numbers, and every level holds."""
        return not self.problems

    @property
    def problems(self) -> list[str]:
        """A line for each log that does not, then those of the levels."""
        logs = [_line(log) for log in self.logs if not log.ok]
        return [*logs, *self.level_problems]

    @property
    def level_problems(self) -> list[str]:
        """A line for each problem that is not one log's alone."""
        return [line for check in self.checks for line in check.lines()]

    @property
    def steps(self) -> int:
        """Control steps that were simulated again."""
        return sum(log.steps for log in self.logs)

    def __str__(self) -> str:
        """Return how many logs were verified, and the remarks."""
        levels = [
            f"{c.level}: {'holds' if c.ok else 'FAILS'}; {c.note}" for c in self.checks
        ]
        fresh = [str(each) for each in self.fresh]
        return "\n".join([*self._verdict(), *levels, *fresh, *self.remarks])

    def _verdict(self) -> Iterator[str]:
        good = sum(log.ok for log in self.logs)
        if any(check.level == "published" for check in self.checks):
            return
        if self.checks or self.path.is_dir():
            yield (
                f"{good} of {len(self.logs)} logs verified, {self.steps} steps "
                "simulated again"
            )
        elif not good:
            yield f"{self.path}: not verified"
        else:
            yield (
                f"{self.path}: verified, {self.steps} steps and the row are the same "
                "bit for bit"
            )


def verify(
    target: Results | str | Path,
    *,
    workers: int | None = None,
    rerun: bool = False,
    fresh_seed: int | None = None,
    scenes_per_family: int | None = None,
    trust_code: bool = False,
    on_log: Callable[[Verification, int], None] = lambda _, total: None,
) -> Verified:
    """Check what a log, a run or a bundle claims; docs/verification.md has the levels.

    The same as `beacon-mj verify`. Logged episodes are simulated again, and every state
    and row compared bit for bit. Of a run, tables and scenes are made again too.

    Args:
        target: A log, a folder with logs below it, a run folder, a bundle, or results.
        workers: Processes; by default one per usable core.
        rerun: Run the planners again too, and compare their commands.
        fresh_seed: Also run them on unseen scenes of this seed.
        scenes_per_family: How many of those; by default as many as the run has.
        trust_code: Run the files of planners and layouts that only the run names.
        on_log: Told what came of each log as it is done, in any order, and how many
            logs there are.

    Raises:
        BeaconError: If there is nothing to verify.
    """
    check_whole_numbers(
        fresh_seed=fresh_seed, scenes_per_family=scenes_per_family, workers=workers
    )
    path = target.folder if isinstance(target, Results) else Path(target)
    if not path.exists():
        raise LogError(f"{path}: cannot read the log: no such file or folder.")
    asked = Asked(
        workers=workers or usable_cores(),
        rerun=rerun,
        fresh_seed=fresh_seed,
        scenes_per_family=scenes_per_family,
        trust_code=trust_code,
    )
    if is_bundle(path):
        return _verified_bundle(path, asked, on_log)
    if path.is_dir():
        return _verified_folder(path, asked, on_log)
    _check_run_asked(path, asked)
    return _verified_log(path, on_log)


def bundle(run: Results | str | Path, out: str | Path) -> Path:
    """Write a finished run as one file that `verify` takes; return its path.

    The same as `beacon-mj bundle`. The same run gives the same bytes.

    Args:
        run: Results or a run folder.
        out: The file.

    Raises:
        BeaconError: If the run is unfinished, or what it was run with has changed.
    """
    folder = run.folder if isinstance(run, Results) else Path(run)
    return write_bundle(folder, Path(out))


def _check_run_asked(path: Path, asked: Asked) -> None:
    if asked.rerun or asked.fresh_seed is not None:
        raise RunError(
            f"{path}: expected a run folder or a bundle with --rerun and --fresh-seed."
        )


def _verified_bundle(
    path: Path, asked: Asked, on_log: Callable[[Verification, int], None]
) -> Verified:
    """Verify a bundle as the run that it holds."""
    with tempfile.TemporaryDirectory(prefix="beacon-mj-") as name:
        folder = Path(name).resolve()
        run = unpack(path, folder)
        config = relocated(run, folder)
        asked = replace(asked, config=config)
        asked.check_trusted(config)
        found = _verified_folder(run, asked, on_log)
        told = str(folder)
        return replace(
            found,
            path=path,
            logs=tuple(_renamed_log(log, told, path) for log in found.logs),
            remarks=tuple(text.replace(told, str(path)) for text in found.remarks),
            checks=tuple(_renamed(check, told, path) for check in found.checks),
        )


def _renamed(check: Check, folder: str, bundle: Path) -> Check:
    """Return what came of a level, naming the bundle and not where it was unpacked."""
    problems = tuple(text.replace(folder, str(bundle)) for text in check.problems)
    return replace(check, problems=problems)


def _renamed_log(log: Verification, folder: str, bundle: Path) -> Verification:
    problem = None if log.problem is None else log.problem.replace(folder, str(bundle))
    return replace(log, problem=problem)


def _verified_folder(
    path: Path, asked: Asked, on_log: Callable[[Verification, int], None]
) -> Verified:
    """Verify all logs below a folder, and the run if it is one."""
    if not (path / CONFIG).is_file():
        _check_run_asked(path, asked)
        return _verified_logs(path, logs_below(path), asked.workers, on_log)
    found: list[Verified] = []

    def verified() -> Sequence[Verification]:
        logs = files_below(path, ".mcap")
        found.append(_verified_logs(path, logs, asked.workers, on_log))
        return found[0].logs

    checks, fresh = check_run(path, asked, verified)
    whole = found[0] if found else Verified(path=path, logs=(), remarks=())
    return replace(whole, checks=tuple(checks), fresh=tuple(fresh))


def _verified_logs(
    path: Path,
    paths: list[Path],
    workers: int,
    on_log: Callable[[Verification, int], None],
) -> Verified:
    found = []
    for each in verify_logs(paths, max(1, min(workers, len(paths)))):
        found.append(each)
        on_log(each, len(paths))
    return Verified(
        path=path,
        logs=tuple(sorted(found, key=lambda log: log.path)),
        remarks=tuple(_remarks(path, paths)) if paths else (),
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
