"""Level `planner`: the planner is run again, and gives the same commands.

It is the only proof that the planner which is named made the decisions: a log whose
commands are another planner's proves its physics just as well.
"""

import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec

from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.errors import BeaconError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import PlannerEntry, RunConfig, SceneRef
from beacon_mj.eval.runs.lineup import PYTHON
from beacon_mj.eval.runs.log_files import log_file
from beacon_mj.eval.runs.runner import plan, run_jobs
from beacon_mj.eval.runs.variants import configuration
from beacon_mj.eval.verification.checks import Check
from beacon_mj.eval.verification.rates import rate_results
from beacon_mj.recording.differences import first_difference


def check_planners(
    run: Path,
    config: RunConfig,
    refs: Sequence[SceneRef],
    rows: Sequence[Row],
    workers: int,
) -> Check:
    """Run every episode again, and compare rows, and logs message by message.

    Planners from files run in processes of their own, whatever the record says. Of
    those that say that their rows need not repeat, rates are compared.

    Args:
        run: The run folder.
        config: Its configuration.
        refs: Its scenes.
        rows: Its rows.
        workers: Processes.
    """
    handed = [e.name for e in config.planners if e.spec.startswith(PYTHON)]
    again = guarded(config)
    kept = {row.key: row for row in rows if row.planner not in handed}
    problems = [
        f"{run}: {name} was a class, and cannot be run again" for name in handed
    ]
    loose, logs, found = list[str](), 0, list[Row]()
    try:
        loose = _inexact(again)
        for row, path in _episodes(again, refs, kept, workers):
            if row.planner in loose:
                found.append(row)
                continue
            log = log_file(run, row.planner, row.scene_name)
            problem = row_difference(kept[row.key], row)
            if problem is None and log.is_file() and path is not None:
                logs += 1
                problem = first_difference(log, path, "when run again")
            if problem is not None:
                problems.append(f"{_name(row)}: {_without(problem, log)}")
    except BeaconError as error:
        problems.append(f"{run}: {error}")
    problems += _worse(run, rows, found)
    note = f"{len(kept)} episodes run again, {logs} logs compared in every message"
    if loose:
        note += f"; of {', '.join(loose)} only the rates, for its rows need not repeat"
    return Check(level="planner", problems=tuple(sorted(problems)), note=note)


def _worse(run: Path, claimed: Sequence[Row], found: Sequence[Row]) -> list[str]:
    """Return a line for each rate that is below what is claimed, not by chance."""
    return [
        f"{run}: {each.told('when run again')}: more than chance"
        for each in rate_results(claimed, found)
        if not each.consistent
    ]


def guarded(config: RunConfig) -> RunConfig:
    """Return a configuration that logs all, and isolates planners from files."""
    entries = tuple(_isolated(entry) for entry in config.planners)
    return msgspec.structs.replace(config, planners=entries, log="all")


def row_difference(stored: Row, ours: Row) -> str | None:
    """Say in which column two rows differ, the wall clock's left out, or None."""
    for name, value in stored.as_dict().items():
        other = getattr(ours, name)
        if name not in WALL_CLOCK_COLUMNS and value != other:
            return f"{name} is {value!r} in the rows but {other!r} when run again"
    return None


def _inexact(config: RunConfig) -> list[str]:
    """Return the planners whose classes, not only their record, say that of them."""
    names = []
    for entry in config.planners:
        if entry.name in config.inexact:
            here = msgspec.structs.replace(entry, spec=entry.loaded_from)
            said = configuration(here, entry.settings, config.protocol)
            if not said.bit_reproducible:
                names.append(entry.name)
    return names


def _isolated(entry: PlannerEntry) -> PlannerEntry:
    return msgspec.structs.replace(entry, isolated=entry.isolated or bool(entry.home))


def _episodes(
    config: RunConfig, refs: Sequence[SceneRef], kept: dict[tuple[str, str, int], Row],
    workers: int,
) -> Iterator[tuple[Row, Path | None]]:  # fmt: skip
    """Yield the row of each episode that is run again, and its log, then removed."""
    planned = [
        job._replace(planners=names)
        for job in plan(config, refs)
        if (
            names := tuple(
                n
                for n in job.planners
                if any((n, ref.family, ref.index) in kept for ref in job.refs)
            )
        )
    ]
    with tempfile.TemporaryDirectory(prefix="beacon-mj-") as name:
        folder = Path(name)
        count = max(1, min(workers, len(planned)))
        for rows in run_jobs(config, planned, folder, count):
            for row in rows:
                path = log_file(folder, row.planner, row.scene_name)
                if row.key in kept:
                    yield row, path if path.is_file() else None
                path.unlink(missing_ok=True)


def _name(row: Row) -> str:
    return f"{row.planner} in {row.scene_name}"


def _without(problem: str, log: Path) -> str:
    return problem.removeprefix(f"{log}: ")
