"""Level `fresh`: the planners on scenes that nobody can have seen.

Seeds are public, so that a planner could make the truth of a published run anew from
its own copy of the generator. On a seed that is chosen now it cannot: there it does
worse than it claims.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig, scene_refs, with_count
from beacon_mj.eval.runs.lineup import PYTHON
from beacon_mj.eval.runs.progress import Progress, quiet
from beacon_mj.eval.runs.runner import plan, run_jobs
from beacon_mj.eval.verification.checks import Check
from beacon_mj.eval.verification.rates import FreshResult, rate_results
from beacon_mj.eval.verification.rerun import guarded


def check_fresh(
    run: Path,
    config: RunConfig,
    rows: Sequence[Row],
    *,
    seed: int,
    scenes_per_family: int | None,
    workers: int,
    progress: Progress = quiet,
) -> tuple[Check, list[FreshResult]]:
    """Run the planners on the same families with another seed.

    Args:
        run: The run folder, for messages.
        config: Its configuration.
        rows: Its rows, the claim.
        seed: The fresh seed.
        scenes_per_family: How many; None for as many as the run has.
        workers: Processes.
        progress: Opens the display of progress.

    Raises:
        RunError: If the run's scenes are not generated, or the seed is its own.
    """
    fresh = _configured(run, config, seed, scenes_per_family)
    _, refs = scene_refs(fresh)
    jobs = plan(fresh, refs)
    found = _rows(fresh, jobs, workers, progress)
    results = rate_results(rows, found)
    problems = [
        f"{run}: {each}: more than chance" for each in results if not each.consistent
    ]
    note = f"{len(found)} episodes on {len(refs)} scenes of seed {seed}"
    return Check(level="fresh", problems=tuple(problems), note=note), results


def _configured(
    run: Path, config: RunConfig, seed: int, scenes_per_family: int | None
) -> RunConfig:
    if config.scene_dir is not None:
        raise RunError(
            f"{run}: --fresh-seed: expected a run on generated scenes but it is on "
            f"those stored in {config.scene_dir}."
        )
    if seed == config.seed:
        raise RunError(
            f"{run}: --fresh-seed: expected another seed than the run's, {seed}."
        )
    handed = [e.name for e in config.planners if e.spec.startswith(PYTHON)]
    if handed:
        raise RunError(
            f"{run}: {handed[0]} was given as a Python class and cannot be run again."
        )
    if scenes_per_family is not None:
        config = with_count(config, scenes_per_family)
    return msgspec.structs.replace(
        guarded(config),
        seed=seed,
        shard=None,
        log="none",
    )


def _rows(config: RunConfig, jobs: Any, workers: int, progress: Progress) -> list[Row]:
    found: list[Row] = []
    total = sum(len(job.planners) for job in jobs)
    with progress("", total) as update:
        for rows in run_jobs(config, jobs, None, max(1, min(workers, len(jobs)))):
            found += rows
            update(rows)
    return found
