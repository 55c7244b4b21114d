"""Level `published`: the tables of the documentation, run again on this machine."""

import hashlib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from beacon_mj.eval.metrics.row import Row, rows_sha256
from beacon_mj.eval.runs.config import RunConfig, scene_refs
from beacon_mj.eval.runs.jobs import Job
from beacon_mj.eval.runs.progress import Progress, quiet
from beacon_mj.eval.runs.runner import plan, run_jobs
from beacon_mj.eval.runs.versions import versions
from beacon_mj.eval.verification.checks import Check
from beacon_mj.eval.verification.records import (
    Episode,
    Record,
    episode_of,
    read_records,
)
from beacon_mj.eval.verification.scenes import family_problems
from beacon_mj.recording.tolerance import TOLERANCE_M
from beacon_mj.recording.verify import same_kind


def check_published(
    records: Path,
    *,
    fraction: float | None,
    workers: int,
    progress: Progress = quiet,
) -> list[Check]:
    """Run published episodes again and compare them; one check a table.

    Args:
        records: Folder of the records.
        fraction: Share of each table's scenes or missions, for every planner; None for
            so few that each planner and each family is there.
        workers: Processes.
        progress: Opens the display of progress of each table.

    Raises:
        BeaconError: If there is no table, or a scene cannot be made.
    """
    return [
        _checked(record, fraction, workers, progress)
        for record in read_records(records)
    ]


def _checked(
    record: Record, fraction: float | None, workers: int, progress: Progress
) -> Check:
    config = msgspec.structs.replace(record.table.config, log="none", shard=None)
    if problems := [*family_problems(record.name, config)]:
        return Check(level="published", problems=tuple(problems), note=record.name)
    jobs = sample(config, fraction)
    rows = _rows(config, jobs, workers, progress, record.name)
    exact = same_kind(config.versions.get("machine", ""), config.machines)
    problems = sorted(
        f"{record.name}: {row.planner} in {row.scene_name}: {problem}"
        for row in rows
        if (problem := difference(record.episodes.get(row.key), row, exact))
    )
    if len(rows) == record.table.rows and exact and not problems:
        problems = [*_digest_problem(record, rows)]
    note = f"{record.name}: {len(rows)} of {record.table.rows} episodes run again, "
    note += "rows bit for bit" if exact else _NEAR
    return Check(
        level="published",
        problems=tuple(problems),
        note=note + _other_versions(config.versions),
    )


_NEAR = (
    "on another kind of machine: outcomes and steps exactly, paths within "
    f"{TOLERANCE_M:g} m"
)


def sample(config: RunConfig, fraction: float | None) -> list[Job]:
    """Return what is run again: always the same, and nobody's choice.

    Scenes and missions are ordered by a hash of their names; of every planner the first
    ones run. Without a fraction planner k runs through the first scene of family k,
    counted round, until all planners and families have had their turn.

    Args:
        config: The run.
        fraction: Share of its scenes and missions.
    """
    _, refs = scene_refs(config)
    jobs = sorted(plan(config, refs), key=_lot)
    if fraction is not None:
        return jobs[: math.ceil(fraction * len(jobs))]
    first = {job.refs[0].family: job for job in reversed(jobs)}
    planners, families = [e.name for e in config.planners], sorted(first)
    turns: dict[str, list[str]] = {family: [] for family in families}
    for k in range(max(len(planners), len(families))):
        turns[families[k % len(families)]].append(planners[k % len(planners)])
    return [first[f]._replace(planners=tuple(names)) for f, names in turns.items()]


def _lot(job: Job) -> str:
    """Return what orders scenes: a hash, so that no order of indices is in it."""
    return hashlib.sha256(
        f"{job.refs[0].family} {job.refs[0].index}".encode()
    ).hexdigest()


def _rows(
    config: RunConfig, jobs: Sequence[Job], workers: int, progress: Progress, name: str
) -> list[Row]:
    rows: list[Row] = []
    with progress(name, sum(len(job.keys) for job in jobs)) as update:
        update(())
        for new in run_jobs(config, jobs, None, max(1, min(workers, len(jobs)))):
            rows += new
            update(new)
    return rows


def difference(published: Episode | None, row: Row, exact: bool) -> str | None:
    """Say how an episode differs from the published one, or return None.

    Args:
        published: How it ended; None if the table does not have it.
        row: Its row here.
        exact: Whether the row must be the same bit for bit.
    """
    if published is None:
        return "is not in the published table"
    ours = episode_of(row)
    for name in ("outcome", "steps", "path_length_m"):
        there, here = getattr(published, name), getattr(ours, name)
        near = name == "path_length_m" and abs(there - here) <= TOLERANCE_M
        if there != here and (exact or not near):
            return f"{name} is {there!r} as published but {here!r} here"
    if exact and ours.sha256 != published.sha256:
        return "another column than outcome, steps and path differs from the published"
    return None


def _digest_problem(record: Record, rows: Sequence[Row]) -> Sequence[str]:
    """Return how the digest of the whole table differs from the published one."""
    found = rows_sha256(rows)
    if found == record.table.rows_sha256:
        return ()
    return (
        f"{record.name}: the SHA-256 of its rows is {record.table.rows_sha256} as "
        f"published but {found} here",
    )


def _other_versions(published: Mapping[str, str]) -> str:
    """Say which versions are others, for rows may then be others too."""
    here = versions()
    others = [
        f"{name} {there} there, {here.get(name)} here"
        for name, there in published.items()
        if here.get(name) != there and name not in ("machine", "python")
    ]
    return f"; {'; '.join(others)}" if others else ""
