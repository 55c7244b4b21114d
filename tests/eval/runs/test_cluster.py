"""Episodes on a real dask scheduler, with worker processes that die."""

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import msgspec
import pytest

from beacon_mj.errors import RunError
from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.runs import cluster
from beacon_mj.eval.runs.cluster import checked_job, run_on_cluster
from beacon_mj.eval.runs.runner import plan, resumable, run_jobs
from tests.eval.runs.test_runner import configured, hostile, run, timeless
from tests.repository import REPOSITORY

pytest.importorskip("distributed")
# dask leaves sockets and loops to the garbage collector when a worker is lost.
pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


def dask(
    *arguments: str, folder: Path, failures: str = "3"
) -> "subprocess.Popen[bytes]":
    """Start a scheduler or a worker in a process group of its own."""
    environment = {
        "PYTHONPATH": str(REPOSITORY),
        "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": failures,
        "DASK_DISTRIBUTED__DASHBOARD__LINK": "",
    }
    return subprocess.Popen(
        [sys.executable, "-m", "distributed.cli." + arguments[0], *arguments[1:]],
        env=os.environ | environment,
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


class Cluster:
    """A scheduler and two workers on 127.0.0.1.

    Without a nanny a worker that dies stays dead.
    """

    def __init__(self, folder: Path, nanny: str) -> None:
        self.folder = folder
        port = free_port()
        self.address = f"tcp://127.0.0.1:{port}"
        options = ["--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
        failures = "3" if nanny == "--no-nanny" else "0"
        self.children = [
            dask("dask_scheduler", *options, folder=folder, failures=failures)
        ]
        self.workers = [self.add_worker(nanny), self.add_worker(nanny)]

    def add_worker(self, nanny: str) -> "subprocess.Popen[bytes]":
        options = ["--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1", nanny]
        found = dask("dask_worker", self.address, *options, folder=self.folder)
        self.children.append(found)
        return found

    def close(self) -> None:
        for child in reversed(self.children):
            with suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGKILL)
            child.wait()


@pytest.fixture(params=["--no-nanny"])
def workers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> Iterator[Cluster]:
    monkeypatch.setattr(cluster, "CONNECT_S", 90.0)
    made = Cluster(tmp_path, request.param)
    yield made
    made.close()


def by_key(rows: list[Row]) -> list[Row]:
    return sorted(rows, key=lambda row: row.key)


def test_a_killed_worker_costs_no_episode(workers: Cluster) -> None:
    config, refs = configured(["push-through", "bug1"], scenes_per_family=6)
    found: list[Row] = []
    for rows in run_on_cluster(config, plan(config, refs), None, workers.address):
        if not found:
            # It holds a job that is under way, and others that wait for it.
            os.killpg(workers.workers[0].pid, signal.SIGKILL)
        found += rows
    assert workers.workers[0].poll() is not None
    assert workers.workers[1].poll() is None
    assert len(found) == 12
    assert timeless(by_key(found)) == timeless(run(config, refs))


def test_a_killed_scheduler_is_one_line_and_loses_no_finished_episode(
    workers: Cluster,
) -> None:
    config, refs = configured(["push-through", "bug1"], scenes_per_family=6)
    found: list[Row] = []

    def collect() -> None:
        for rows in run_on_cluster(config, plan(config, refs), None, workers.address):
            if not found:
                os.killpg(workers.children[0].pid, signal.SIGKILL)
            found.extend(rows)

    with pytest.raises(RunError, match=r"scheduler was lost; go on with --resume"):
        collect()
    assert 0 < len(found) < 12
    left = plan(config, refs, found)
    again = [row for rows in run_jobs(config, left) for row in rows]
    whole = by_key([*resumable(left, found), *again])
    assert timeless(whole) == timeless(run(config, refs))


@pytest.mark.parametrize("workers", ["--nanny"], indirect=True)
def test_a_planner_that_kills_its_worker_costs_its_own_episode(
    workers: Cluster,
) -> None:
    config, refs = configured(
        [hostile("Dies"), "push-through"],
        settings=["protocol.max_steps=120", "Dies.at=2"],
        isolate=False,
    )
    jobs = plan(config, refs)
    found = [
        r for rows in run_on_cluster(config, jobs, None, workers.address) for r in rows
    ]
    bad, good = by_key(found)
    assert (bad.outcome, bad.detail) == ("planner_error", cluster.DIED)
    assert good.success


def test_a_worker_that_cannot_run_this_says_so(tmp_path: Path) -> None:
    config, refs = configured(["push-through"])
    [job] = plan(config, refs)
    other = msgspec.structs.replace(
        config, versions=config.versions | {"mujoco": "1.2.3"}
    )
    with pytest.raises(RunError, match=r"worker on .*: expected mujoco 1\.2\.3 but"):
        checked_job(other, None, {}, job)
    with pytest.raises(RunError, match=r"nowhere: no such folder\. Use --log none"):
        checked_job(config, tmp_path / "nowhere", {}, job)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense://", "x"])
def test_no_scheduler_is_one_error(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "CONNECT_S", 0.5)
    config, refs = configured(["push-through"])
    with pytest.raises(RunError, match=f"--cluster {address}: expected a dask sched"):
        next(run_on_cluster(config, plan(config, refs), None, address))
