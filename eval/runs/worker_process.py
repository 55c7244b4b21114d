"""What a worker process does first."""

import gc
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

T = TypeVar("T")

PARENT_S = 1.0  #: Time between two looks at whether the parent still lives [s].
#: New objects after which a worker looks for garbage. An episode keeps what it makes,
#: so Python's 700 take a tenth of an episode's time, and find nothing.
COLLECT_AFTER = 20_000


def usable_cores() -> int:
    """Return how many processes can compute at once here, at least 1.

    The cores that this process may use, by its affinity and its control group's quota,
    which in a container or a batch job are fewer than the machine has.
    """
    import joblib  # Not paid for by `--help`.

    return max(1, int(joblib.cpu_count()))


def prepare_worker() -> None:
    """Leave Ctrl-C to the parent, which stops its workers itself, and end with it."""
    gc.set_threshold(COLLECT_AFTER)
    parent = multiprocessing.parent_process()
    if parent is not None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def in_parallel(
    function: Callable[..., T], jobs: Sequence[tuple[Any, ...]], workers: int
) -> Iterator[T]:
    """Yield what a function returns for each job's arguments, in any order.

    Args:
        function: Of a module, so that a process can import it.
        jobs: Its arguments, a tuple a job.
        workers: Processes; with 1 everything runs in this one.
    """
    if workers == 1 or len(jobs) < 2:
        yield from (function(*job) for job in jobs)
        return
    import joblib

    with joblib.parallel_config(backend="loky", inner_max_num_threads=1):
        pool = joblib.Parallel(
            n_jobs=min(workers, len(jobs)),
            return_as="generator_unordered",
            batch_size=1,
            initializer=prepare_worker,
        )
        folder, call = os.getcwd(), joblib.delayed(in_folder)
        yield from pool(call(folder, function, *job) for job in jobs)


def in_folder(folder: str, function: Callable[..., T], *arguments: object) -> T:
    """Call a function in the folder that the parent is in now.

    Workers outlive a run, so that a later one finds them where the parent was before.
    """
    os.chdir(folder)
    return function(*arguments)


def _end_with(parent: BaseProcess) -> None:
    """End this process, whatever it is doing, once the parent has.

    A parent that is killed cannot tell its workers. Linux's PR_SET_PDEATHSIG would, but
    means the thread that started the worker, which may well end before the parent.
    """
    if os.name == "nt":  # There the id of the parent stays when the parent is gone.
        parent.join()
        os._exit(1)
    while os.getppid() == parent.pid:
        time.sleep(PARENT_S)
    os._exit(1)
