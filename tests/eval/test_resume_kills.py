"""A run that is killed at any time can be gone on with, and gives the same rows."""

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import polars as pl
import pytest

from beacon_mj.constants import WALL_CLOCK_COLUMNS
from beacon_mj.eval.run_folder import load_rows
from tests.eval.test_runner import timeless

REPOSITORY = Path(__file__).parents[2]
EPISODES = 8
RUN = [
    "--planner", "push-through", "--planner", "bug1", "--family", "sparse",
    "--episodes", str(EPISODES // 2),
]  # fmt: skip


def start(out: Path, *options: str) -> "subprocess.Popen[str]":
    """Start a run in a process group of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "beacon_mj", "eval", "--out", str(out), *options],
        env=os.environ | {"PYTHONPATH": str(REPOSITORY)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def complete(out: Path, workers: str) -> float:
    """Run, or go on, to the end; return how long it took [s]."""
    began = time.monotonic()
    process = start(out, *RUN, "--workers", workers, "--resume")
    _, err = process.communicate(timeout=300.0)
    assert process.returncode == 0, err
    return time.monotonic() - began


def lines(out: Path) -> int:
    path = out / "episodes.jsonl"
    return path.read_bytes().count(b"\n") if path.exists() else 0


def killed(out: Path, workers: str, chance: random.Random, duration_s: float) -> bool:
    """Go on with a run and kill it at a random time; whether that came before its end.

    Half of the times count from the start, half from the next finished episode.
    """
    process = start(out, *RUN, "--workers", workers, "--resume")
    deadline = time.monotonic() + chance.uniform(0.0, duration_s)
    if chance.random() < 0.5:
        before = lines(out)
        while process.poll() is None and lines(out) == before:
            time.sleep(0.005)
        deadline = time.monotonic() + chance.uniform(0.0, 0.2)
    while process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.002)
    alive = process.poll() is None
    if alive:
        os.killpg(process.pid, signal.SIGKILL)
    _, err = process.communicate(timeout=60.0)
    assert alive or process.returncode == 0, err
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


@pytest.mark.parametrize(
    ("kills", "workers"),
    [(3, "1"), pytest.param(50, "2", marks=pytest.mark.slow)],
)
def test_killed_runs_go_on_to_the_same_rows(
    tmp_path: Path, kills: int, workers: str
) -> None:
    chance = random.Random(kills)
    whole, count, number = tmp_path / "whole", 0, 0
    duration_s = complete(whole, workers)
    while count < kills:
        out = tmp_path / f"run{number}"
        while count < kills and killed(out, workers, chance, duration_s):
            count += 1
        complete(out, workers)
        check_equal(out, whole)
        number += 1
    assert count == kills


def test_sigterm_ends_a_run_like_ctrl_c(tmp_path: Path) -> None:
    out = tmp_path / "run"
    process = start(
        out, *RUN[:-1], "150", "--workers", "2", "--log", "none",
        "--set", "protocol.max_steps=50",
    )  # fmt: skip
    deadline = time.monotonic() + 120.0
    while lines(out) < 3:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.02)
    process.terminate()
    _, err = process.communicate(timeout=60.0)
    assert process.returncode == 143
    assert "interrupted: " in err
    assert "--resume" in err
    assert "Traceback" not in err
    assert 3 <= len(load_rows(out)) < 300
