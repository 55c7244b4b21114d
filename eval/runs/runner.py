"""Running an evaluation on several processes.

Jobs are independent and seeded by what they are, not by when or where they run, so
results do not depend on the number of workers or the order. A process that dies takes
its pool with it: the jobs that were under way are then run again, one episode at a time
in one process, and only an episode that kills its process twice is lost.
"""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from types import MappingProxyType

from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import (
    RunConfig,
    SceneRef,
    load_ref,
    suite_of_ref,
)
from beacon_mj.eval.runs.jobs import (
    Attempt,
    Fault,
    Handovers,
    Job,
    lost_row,
    run_job,
)
from beacon_mj.eval.runs.warm_up import compile_kernels
from beacon_mj.eval.runs.worker_process import in_folder, prepare_worker

NOBODY: Handovers = MappingProxyType({})
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
    for ref in refs:
        names = tuple(
            e.name
            for e in config.planners
            if (e.name, ref.family, ref.index) not in finished
        )
        if names:
            jobs.append(Job(ref, names))
    return jobs


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
    compile_kernels()
    work = partial(run_job, config, folder, handed)
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
    for job in (single for each in jobs for single in each.split()):
        pool = pool or ProcessPoolExecutor(1, initializer=prepare_worker)
        try:
            yield pool.submit(in_folder, os.getcwd(), work, job).result()
        except BrokenProcessPool:
            pool = None
            detail = "the process died while the planner ran"
            scene = load_ref(config, job.ref)
            suite = suite_of_ref(config, job.ref, scene)
            name = job.planners[0]
            row = lost_row(config, scene, name, "planner_error", detail, suite)
            yield Attempt([row], [Fault(row.key, detail, "")])
    if pool is not None:
        pool.shutdown(kill_workers=True)
