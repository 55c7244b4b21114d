"""What a worker process does first."""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from multiprocessing.process import BaseProcess
from typing import TypeVar

T = TypeVar("T")

PARENT_S = 1.0  #: Time between two looks at whether the parent still lives [s].


def usable_cores() -> int:
    """Return how many processes can compute at once here, at least 1.

    The cores that this process may use, by its affinity and its control group's quota,
    which in a container or a batch job are fewer than the machine has.
    """
    import joblib  # Not paid for by `--help`.

    return max(1, int(joblib.cpu_count()))


def prepare_worker() -> None:
    """Leave Ctrl-C to the parent, which stops its workers itself, and end with it."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


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
