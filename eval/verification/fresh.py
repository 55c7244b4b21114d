"""Level `fresh`: the planners on scenes that nobody can have seen.

Seeds are public, so that a planner could make the truth of a published run anew from
its own copy of the generator. On a seed that is chosen now it cannot: there it does
worse than it claims.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig, scene_refs, with_count
from beacon_mj.eval.runs.lineup import PYTHON
from beacon_mj.eval.runs.progress import Progress, quiet
from beacon_mj.eval.runs.runner import plan, run_jobs
from beacon_mj.eval.statistics.intervals import mean_interval, wilson_interval
from beacon_mj.eval.verification.checks import Check
from beacon_mj.eval.verification.rerun import guarded

RATES = ("success", "clean_success")
#: Coverage of the interval of a difference that counts as a failure: honest results
#: on two seeds differ too, and a run has many planners.
CONFIDENCE = 0.999


class Estimate(NamedTuple):
    """A mean with its 95 % interval; NaN ends over too few scenes."""

    mean: float
    low: float
    high: float


class FreshResult(NamedTuple):
    """What one planner claims, and what it does on fresh scenes.

    Attributes:
        planner: Its name.
        column: `success`, `clean_success` or `steps`.
        claimed: Over the scenes of the run.
        fresh: Over the fresh scenes.
        consistent: Whether a difference of rates of this size may be chance (99.9 %).
    """

    planner: str
    column: str
    claimed: Estimate
    fresh: Estimate
    consistent: bool

    def __str__(self) -> str:
        """Return one line."""
        return (
            f"{self.planner}: {self.column} {_text(self.column, self.fresh)} on fresh "
            f"scenes, {_text(self.column, self.claimed)} claimed"
        )


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
    results = _results(rows, found)
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


def _results(claimed: Sequence[Row], fresh: Sequence[Row]) -> list[FreshResult]:
    """Return a line a planner and column."""
    out = []
    for planner in dict.fromkeys(row.planner for row in fresh):
        ours, theirs = (
            [row for row in rows if row.planner == planner] for rows in (claimed, fresh)
        )
        if not ours:
            continue
        out += [_rate(planner, name, ours, theirs) for name in RATES]
        claim, mean = (_mean([float(r.steps) for r in rows]) for rows in (ours, theirs))
        out.append(FreshResult(planner, "steps", claim, mean, True))
    return out


def _rate(
    planner: str, column: str, claimed: Sequence[Row], fresh: Sequence[Row]
) -> FreshResult:
    counts = [
        (sum(bool(getattr(row, column)) for row in rows), len(rows))
        for rows in (claimed, fresh)
    ]
    claim, rate = (Estimate(k / n, *wilson_interval(k, n)) for k, n in counts)
    return FreshResult(planner, column, claim, rate, _consistent(*counts))


def _consistent(claimed: tuple[int, int], fresh: tuple[int, int]) -> bool:
    """Whether the claimed rate is not above the fresh one by more than chance.

    Newcombe's score interval of the difference of two independent rates (1998, method
    10): d - sqrt((p1 - l1)^2 + (u2 - p2)^2), with Wilson's intervals (l, u) of each.
    """
    (k1, n1), (k2, n2) = claimed, fresh
    l1, _ = wilson_interval(k1, n1, CONFIDENCE)
    _, u2 = wilson_interval(k2, n2, CONFIDENCE)
    p1, p2 = k1 / n1, k2 / n2
    spread = math.sqrt((p1 - l1) ** 2 + (u2 - p2) ** 2)
    return p1 - p2 - spread <= 0.0


def _mean(values: Sequence[float]) -> Estimate:
    return Estimate(*mean_interval(values))


def _text(column: str, found: Estimate) -> str:
    scale, unit = (100.0, " %") if column in RATES else (1.0, "")
    mean, low, high = (scale * value for value in found)
    return f"{mean:.1f}{unit} [{low:.1f}, {high:.1f}]"
