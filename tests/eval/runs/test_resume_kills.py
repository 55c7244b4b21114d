"""A run that is killed at any time can be gone on with, and gives the same rows."""

import multiprocessing
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import polars as pl
import pytest

from beacon_mj import cli
from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.eval.runs.run_folder import load_rows
from beacon_mj.eval.runs.scene_cache import VARIABLE
from tests.eval.runs.test_runner import timeless
from tests.repository import REPOSITORY

EPISODES = 8
RUN = [
    "--planner", "push-through", "--planner", "bug1", "--family", "sparse",
    "--no-report", "-n", str(EPISODES // 2),
]  # fmt: skip
#: Forks runs that need not import and compile first, which is most of a small run.
SERVER = multiprocessing.get_context("forkserver")
SERVER.set_forkserver_preload(["tests.eval.warm"])


class Way(NamedTuple):
    """How a run is started: the command, or a fork that skips imports; and on what."""

    fresh: bool
    workers: str


class Run:
    """A run in a process group of its own, new or gone on with."""

    def __init__(self, out: Path, way: Way) -> None:
        self.errors = out.with_name(f"{out.name}.err")
        options = [*RUN, "--workers", way.workers, "--resume"]
        self._command = start(out, *options, errors=self.errors) if way.fresh else None
        if self._command is None:
            arguments = ["eval", "--out", str(out), *options]
            self._fork = SERVER.Process(target=_forked, args=(arguments, self.errors))
            self._fork.start()

    def status(self) -> int | None:
        """Return the exit status, or None while it runs."""
        return self._fork.exitcode if self._command is None else self._command.poll()

    def wait(self) -> int:
        """Wait for the end and return the status."""
        process = self._command
        if process is not None:
            return process.wait(300.0)
        self._fork.join(300.0)
        status = self._fork.exitcode
        assert status is not None
        self._fork.close()
        return status

    def kill(self) -> None:
        """Kill it with its workers."""
        pid = (self._command or self._fork).pid
        assert pid
        with suppress(ProcessLookupError):  # A fork that leads no group yet.
            os.killpg(pid, signal.SIGKILL)
        os.kill(pid, signal.SIGKILL)


def _forked(arguments: list[str], errors: Path) -> None:
    os.setsid()
    with open(os.devnull, "w") as null, open(errors, "w") as file:
        os.dup2(null.fileno(), sys.__stdout__.fileno())  # type: ignore[union-attr]
        os.dup2(file.fileno(), sys.__stderr__.fileno())  # type: ignore[union-attr]
    status = cli.run(arguments)
    sys.stderr.flush()
    os._exit(status)  # Forks of a server would wait for workers that are idle.


def start(out: Path, *options: str, errors: Path) -> "subprocess.Popen[str]":
    """Start the command in a process group of its own."""
    with open(errors, "w") as file:
        return subprocess.Popen(
            [sys.executable, "-m", "beacon_mj", "eval", "--out", str(out), *options],
            env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
            stdout=subprocess.DEVNULL,
            stderr=file,
            text=True,
            start_new_session=True,
        )


def complete(out: Path, way: Way) -> float:
    """Run, or go on, to the end; return how long it took [s]."""
    began = time.monotonic()
    run = Run(out, way)
    assert run.wait() == 0, run.errors.read_text()
    return time.monotonic() - began


def lines(out: Path) -> int:
    path = out / "episodes.jsonl"
    return path.read_bytes().count(b"\n") if path.exists() else 0


def killed(out: Path, way: Way, chance: random.Random, duration_s: float) -> bool:
    """Go on with a run and kill it at a random time; whether that came before its end.

    Half of the times count from the start, half from the next finished episode.
    """
    run = Run(out, way)
    deadline = time.monotonic() + chance.uniform(0.0, duration_s)
    if chance.random() < 0.5:
        before = lines(out)
        while run.status() is None and lines(out) == before:
            time.sleep(0.005)
        deadline = time.monotonic() + chance.uniform(0.0, 0.2)
    while run.status() is None and time.monotonic() < deadline:
        time.sleep(0.002)
    alive = run.status() is None
    if alive:
        run.kill()
    status = run.wait()
    assert alive or status == 0, run.errors.read_text()
    return alive


def check_equal(out: Path, whole: Path) -> None:
    assert len(load_rows(whole)) == EPISODES
    assert timeless(load_rows(out)) == timeless(load_rows(whole))
    tables = [
        pl.read_parquet(run / "episodes.parquet").drop(*WALL_CLOCK_COLUMNS)
        for run in (out, whole)
    ]
    assert tables[0].equals(tables[1])
    assert (out / "config.json").read_bytes() == (whole / "config.json").read_bytes()
    files = [
        sorted(p.relative_to(run) for p in run.rglob("*") if p.is_file())
        for run in (out, whole)
    ]
    assert files[0] == files[1]
    for name in files[0]:
        if name.suffix == ".mcap":
            assert (out / name).read_bytes() == (whole / name).read_bytes()


@pytest.mark.parametrize(
    ("kills", "ways"),
    [
        (3, [Way(True, "1")]),
        pytest.param(
            50,
            [Way(True, "2"), *3 * [Way(False, "1")], *2 * [Way(False, "2")]],
            marks=pytest.mark.slow,
        ),
    ],
)
def test_killed_runs_go_on_to_the_same_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kills: int, ways: list[Way]
) -> None:
    """Each time a run goes on, it does so in any of the ways."""
    monkeypatch.setenv(VARIABLE, str(tmp_path / "cache"))
    chance = random.Random(kills)
    SERVER.Process().start()  # So that no time below is that of its own imports.
    wholes = {way: tmp_path / f"whole{k}" for k, way in enumerate(dict.fromkeys(ways))}
    durations_s = {way: complete(out, way) for way, out in wholes.items()}
    whole, *others = wholes.values()
    for out in others:
        check_equal(out, whole)
    count = number = 0
    while count < kills:
        out = tmp_path / f"run{number}"
        shutil.rmtree(tmp_path / "cache", ignore_errors=True)
        while count < kills:
            way = chance.choice(ways)
            if not killed(out, way, chance, durations_s[way]):
                break
            count += 1
        complete(out, chance.choice(ways))
        check_equal(out, whole)
        number += 1


def test_sigterm_ends_a_run_like_ctrl_c(tmp_path: Path) -> None:
    out = tmp_path / "run"
    process = start(
        out, *RUN[:-1], "150", "--workers", "2", "--log", "none",
        "--set", "protocol.max_steps=50", errors=tmp_path / "errors",
    )  # fmt: skip
    deadline = time.monotonic() + 120.0
    while lines(out) < 3:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.terminate()
    assert process.wait(60.0) == 143
    err = (tmp_path / "errors").read_text()
    assert "interrupted: " in err
    assert "--resume" in err
    assert "Traceback" not in err
    assert 3 <= len(load_rows(out)) < 300
