"""Running an evaluation on the workers of a dask scheduler.

Rows stream back as episodes finish. dask itself runs the jobs of a lost worker again on
another one. A job that several workers died with (`allowed-failures` of the scheduler)
is run once more, one episode at a time with nothing beside it, and only an episode that
its workers die with again is lost: a `planner_error`, as it is on one machine.

Not through joblib, whose dask backend (1.6) never calls back for a task that ended in
`KilledWorker`: one deadly planner, and the run waits for ever.
"""

import socket
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from functools import lru_cache, partial
from itertools import islice
from pathlib import Path
from typing import Any

import msgspec

from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs.config import PlannerEntry, RunConfig
from beacon_mj.eval.runs.jobs import (
    Attempt,
    Fault,
    Handovers,
    Job,
    run_job,
)
from beacon_mj.eval.runs.runner import AHEAD, NOBODY, rescued, told
from beacon_mj.eval.runs.versions import versions
from beacon_mj.extras import missing
from beacon_mj.planners.registry import whole_spec

CONNECT_S = 10.0  #: Time within which scheduler and first worker must answer [s].
DIED = "the worker process died while the planner ran"
LOST = "the cluster's scheduler was lost; go on with --resume."


def run_on_cluster(
    config: RunConfig,
    jobs: Sequence[Job],
    folder: Path | None,
    address: str,
    handed: Handovers = NOBODY,
    on_fault: Callable[[Fault], None] = lambda _: None,
) -> Iterator[list[Row]]:
    """Run jobs on a cluster and yield the rows of each as it finishes, in any order.

    Args:
        config: The evaluation.
        jobs: What to run.
        folder: Run folder, for logs, on a file system that all workers share; None for
            no logs.
        address: Of the scheduler, such as `tcp://node1:8786`.
        handed: Planners that cannot be loaded by their spec, by name.
        on_fault: Told why a planner failed, before its row is yielded.

    Raises:
        RunError: If dask is missing, nobody answers, or a worker cannot run this.
        BeaconError: If a scene cannot be made or read.
    """
    logs = None if folder is None or config.log == "none" else folder.resolve()
    work = partial(checked_job, _portable(config), logs, handed)
    with _client(address) as client:
        suspects = []
        for job, attempt in _stream(work, jobs, client):
            if attempt is None:
                suspects.append(job)
            else:
                yield told(attempt, on_fault)
        for job in (single for suspect in suspects for single in suspect.split()):
            attempt = rescued(config, job, lambda j: _alone(work, j, client), DIED)
            yield told(attempt, on_fault)


def checked_job(
    config: RunConfig, folder: Path | None, handed: Handovers, job: Job
) -> Attempt:
    """Run a job on a worker that can; see `run_job`.

    Raises:
        RunError: If this worker has other versions, or does not see the run folder.
    """
    where = socket.gethostname()
    for name, here in _versions_here().items():
        wanted = config.versions.get(name)
        if here != wanted:
            raise RunError(
                f"worker on {where}: expected {name} {wanted} but it has {here}."
            )
    if folder is not None and not folder.is_dir():
        raise RunError(
            f"worker on {where}: {folder}: no such folder. Use --log none, or a run "
            "folder on a file system that the workers share."
        )
    return run_job(config, folder, handed, job)


@lru_cache(maxsize=1)
def _versions_here() -> dict[str, str]:
    return versions()


def _portable(config: RunConfig) -> RunConfig:
    """Name planners in files by whole paths: a worker runs in another folder."""
    entries = tuple(_whole_path(entry) for entry in config.planners)
    return msgspec.structs.replace(config, planners=entries)


def _whole_path(entry: PlannerEntry) -> PlannerEntry:
    return msgspec.structs.replace(entry, spec=whole_spec(entry.spec))


def _client(address: str) -> Any:
    """Return a client of the scheduler that has at least one worker."""
    try:
        import distributed
        from distributed.comm.addressing import get_address_host_port
    except ImportError as error:
        raise RunError(f"--cluster: {missing(error, 'cluster')}") from error
    make: Any = distributed.Client  # Its constructor has no annotations.
    try:
        # A client of an address that is none would hang when the process ends.
        get_address_host_port(address)
        client = make(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise RunError(
            f"--cluster {address}: expected a dask scheduler, such as "
            f"tcp://node1:8786, but none answered: {str(error) or 'no answer'}."
        ) from error
    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except TimeoutError as error:
        client.close()
        raise RunError(f"--cluster {address}: has no workers.") from error
    return client


def _stream(
    work: Callable[[Job], Attempt], jobs: Iterable[Job], client: Any
) -> Iterator[tuple[Job, Attempt | None]]:
    """Yield each job with what came of it; with None if its workers died."""
    import distributed

    waiting, held = iter(jobs), dict[Any, Job]()
    make: Any = distributed.as_completed  # It has no annotations.
    done = make(loop=client.loop)

    def feed() -> None:
        # Asked anew each time: workers may join and leave.
        try:
            cores = sum(client.ncores().values())
        except (OSError, CancelledError) as error:
            raise RunError(LOST) from error
        room = AHEAD * max(1, cores) - len(held)
        for job in islice(waiting, max(0, room)):
            future = client.submit(work, job, pure=False)
            held[future] = job
            done.add(future)

    feed()
    for future in done:
        job = held.pop(future)
        feed()
        try:
            yield job, future.result()
        except distributed.KilledWorker:
            yield job, None
        except CancelledError as error:
            raise RunError(LOST) from error


def _alone(work: Callable[[Job], Attempt], job: Job, client: Any) -> Attempt | None:
    """Run one episode or mission; None if its workers die again."""
    [(_, attempt)] = _stream(work, [job], client)
    return attempt
