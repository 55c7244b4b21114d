"""Workers do not outlive the process that they work for."""

import gc
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from beacon_mj.eval.runs.worker_process import COLLECT_AFTER, in_parallel
from tests.eval.runs.test_runner import hostile
from tests.repository import REPOSITORY

WITHIN_S = 15.0  #: Time until all must be gone; a second or two but for a busy machine.


def within(seconds: float, met: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + seconds
    while not met():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


def group(leader: int) -> list[str]:
    """Return the commands, uncut, of all live processes in a process group."""
    command = ["ps", "-eww", "-o", "pgid=,stat=,args="]
    listed = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = [line.split(maxsplit=2) for line in listed.stdout.splitlines()]
    return [
        line[2] for line in lines if int(line[0]) == leader and line[1][0] not in "ZX"
    ]


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="Linux has it")
def test_cores_are_those_that_the_process_may_use() -> None:
    code = (
        "import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})\n"
        "from beacon_mj.eval.runs.worker_process import usable_cores\n"
        "print(usable_cores())"
    )
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True
    )
    assert done.stdout == "1\n", done.stderr


@pytest.mark.parametrize("planner", ["Hangs", "Harmless"])
def test_workers_of_a_killed_run_end(planner: str, tmp_path: Path) -> None:
    """Those that are inside a decision as well as those that are between two."""
    parent = subprocess.Popen(
        [
            sys.executable, "-m", "beacon_mj", "eval", "--planner", hostile(planner),
            "--family", "sparse", "-n", "200", "--workers", "2",
            "--set", "protocol.decision_limit_s=1000", "--out", str(tmp_path / "run"),
        ],
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )  # fmt: skip
    try:
        logs = tmp_path / "run" / "logs" / planner
        assert within(120.0, lambda: len([*logs.glob("*")]) >= 2)
        assert len([who for who in group(parent.pid) if "loky" in who]) >= 2
        parent.kill()
        parent.wait()
        assert within(WITHIN_S, lambda: group(parent.pid) == []), group(parent.pid)
    finally:
        if group(parent.pid):
            os.killpg(parent.pid, signal.SIGKILL)
        parent.wait()


def test_workers_seldom_look_for_garbage() -> None:
    found = list(in_parallel(gc.get_threshold, [(), ()], workers=2))
    assert [first for first, *_ in found] == [COLLECT_AFTER] * 2
