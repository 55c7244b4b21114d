"""Running an evaluation on several processes.

A job is a scene, or all days of a mission in order. Jobs are independent and seeded by
what they are, not by when or where they run, so results do not depend on the number of
workers or the order. A process that dies takes its pool with it: the jobs that were
under way are then run again, one episode or mission at a time in one process, and only
an episode that kills its process again is lost.
"""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from types import MappingProxyType

from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import RunConfig, SceneRef
from beacon_mj.eval.runs.jobs import (
    Attempt,
    Fault,
    Handovers,
    Job,
    lost_attempt,
    run_job,
)
from beacon_mj.eval.runs.missions import by_mission
from beacon_mj.eval.runs.warm_up import compile_kernels, load_kernels
from beacon_mj.eval.runs.worker_process import in_folder, prepare_worker

NOBODY: Handovers = MappingProxyType({})
DIED = "the process died while the planner ran"
AHEAD = 2  #: Jobs handed to each worker in advance, so that none waits.


def plan(
    config: RunConfig, refs: Sequence[SceneRef], done: Iterable[Row] = ()
) -> list[Job]:
    """Return the jobs that are left to do.

    Args:
        config: The evaluation.
        refs: Its scenes.
        done: Rows of episodes that are finished.
    """
    finished = {row.key for row in done}
    jobs = []
    for own in by_mission(refs):
        names = tuple(
            e.name
            for e in config.planners
            if any((e.name, ref.family, ref.index) not in finished for ref in own)
        )
        if names:
            jobs.append(Job(own, names))
    return jobs


def resumable(jobs: Iterable[Job], done: Sequence[Row]) -> list[Row]:
    """Return the rows that are none of a job's that is left to do.

    What a half-finished mission has is run again with the rest: its memory is lost.
    """
    again = {key for job in jobs for key in job.keys}
    return [row for row in done if row.key not in again]


def run_jobs(
    config: RunConfig,
    jobs: Sequence[Job],
    folder: Path | None = None,
    workers: int = 1,
    handed: Handovers = NOBODY,
    on_fault: Callable[[Fault], None] = lambda _: None,
) -> Iterator[list[Row]]:
    """Run jobs and yield the rows of each as it finishes, in any order.

    Args:
        config: The evaluation.
        jobs: What to run.
        folder: Run folder, for logs; None for no logs.
        workers: Processes; with 1 everything runs in this one, for a debugger's sake.
        handed: Planners that cannot be loaded by their spec, by name.
        on_fault: Told why a planner failed, before its row is yielded.

    Raises:
        BeaconError: If a scene cannot be made or read.
    """
    specs = tuple(entry.spec for entry in config.planners)
    compile_kernels(specs)
    work = partial(_work, specs, partial(run_job, config, folder, handed))
    if workers == 1:
        for attempt in map(work, jobs):
            yield told(attempt, on_fault)
        return
    left = dict.fromkeys(jobs)
    while left:
        sent: dict[Job, None] = {}
        try:
            for job, attempt in _parallel(work, list(left), sent, workers):
                del left[job]
                yield told(attempt, on_fault)
        except BrokenProcessPool:
            suspects = [job for job in sent if job in left]
            left = {job: None for job in left if job not in sent}
            for attempt in _alone(config, work, suspects):
                yield told(attempt, on_fault)


def _work(specs: Iterable[str], run: Callable[[Job], Attempt], job: Job) -> Attempt:
    """Run a job in a process that has loaded all machine code before."""
    load_kernels(specs)
    return run(job)


def told(attempt: Attempt, on_fault: Callable[[Fault], None]) -> list[Row]:
    """Return the rows of a job after telling of its faults."""
    for fault in attempt.faults:
        on_fault(fault)
    return attempt.rows


def _parallel(
    work: Callable[[Job], Attempt],
    jobs: Sequence[Job],
    sent: dict[Job, None],
    workers: int,
) -> Iterator[tuple[Job, Attempt]]:
    """Yield results as they come; note in `sent` every job that a worker may hold."""
    import joblib

    folder = os.getcwd()

    def feed() -> Iterator[object]:
        for job in jobs:
            sent[job] = None
            yield joblib.delayed(in_folder)(folder, _tagged, work, job)

    with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        pool = joblib.Parallel(
            n_jobs=workers,
            return_as="generator_unordered",
            batch_size=1,
            pre_dispatch=AHEAD * workers,
            initializer=prepare_worker,
        )
        yield from pool(feed())


def _tagged(work: Callable[[Job], Attempt], job: Job) -> tuple[Job, Attempt]:
    return job, work(job)


def _alone(
    config: RunConfig, work: Callable[[Job], Attempt], jobs: Iterable[Job]
) -> Iterator[Attempt]:
    """Run episodes one by one; if the process dies again, it was the planner's."""
    from joblib.externals.loky import ProcessPoolExecutor

    pool = None

    def attempt(job: Job) -> Attempt | None:
        nonlocal pool
        pool = pool or ProcessPoolExecutor(1, initializer=prepare_worker)
        try:
            found: Attempt = pool.submit(in_folder, os.getcwd(), work, job).result()
        except BrokenProcessPool:
            pool = None
            return None
        return found

    for job in (single for each in jobs for single in each.split()):
        yield rescued(config, job, attempt, DIED)
    if pool is not None:
        pool.shutdown(kill_workers=True)


def rescued(
    config: RunConfig, job: Job, attempt: Callable[[Job], Attempt | None], died: str
) -> Attempt:
    """Return what comes of a job of one planner that kills its process.

    Of a mission, the days before the deadly one are kept, and those after it begin
    without memory, as after any other failure.

    Args:
        config: The evaluation.
        job: The job.
        attempt: Runs a job; None if its process died.
        died: What the row of a lost episode says.
    """
    refs, out = job.refs, Attempt([], [])
    while refs:
        whole = attempt(job._replace(refs=refs))
        if whole is not None:
            return _joined(out, whole)
        alive = 0
        for days in range(1, len(refs)):
            before = attempt(job._replace(refs=refs[:days]))
            if before is None:
                break
            alive, whole = days, before
        lost = lost_attempt(config, job._replace(refs=(refs[alive],)), died)
        out = _joined(_joined(out, whole or Attempt([], [])), lost)
        refs = refs[alive + 1 :]
    return out


def _joined(first: Attempt, then: Attempt) -> Attempt:
    return Attempt([*first.rows, *then.rows], [*first.faults, *then.faults])
