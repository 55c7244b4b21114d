"""SIGKILL at any moment costs at most one simulated second, and no finished log."""

import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from beacon_mj.episode.trace import StepRecord
from beacon_mj.errors import LogError
from beacon_mj.recording import read_log, read_trace
from tests.recording.samples import PushThrough, difference
from tests.repository import REPOSITORY

EPISODES, STEPS = 4, 60
SECOND = 10  #: Control steps of one simulated second.
CHILD = f"""
import sys, time
from pathlib import Path
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.protocol import Protocol
from beacon_mj.recording import Recorder
from beacon_mj.scene_gen.generate import generate_scene
from tests.recording.samples import PushThrough

class Telling(Recorder):
    def step(self, record, world, observation):
        super().step(record, world, observation)
        print(self.path.stem, record.outcome.step, flush=True)
        time.sleep(0.003)

for index in range({EPISODES}):
    run_episode(
        generate_scene("sparse", index), PushThrough(),
        protocol=Protocol(max_steps={STEPS}),
        listeners=[Telling(Path(sys.argv[1]) / f"{{index}}.mcap")],
    )
"""
KILLS = [0, 1, *(pytest.param(k, marks=pytest.mark.slow) for k in range(2, 20))]


@pytest.fixture(scope="module")
def live() -> list[list[StepRecord]]:
    """What the child's episodes are, step by step."""
    from beacon_mj.episode.protocol import Protocol
    from beacon_mj.episode.run import run_episode
    from beacon_mj.scene_gen.generate import generate_scene

    protocol = Protocol(max_steps=STEPS)
    scenes = [generate_scene("sparse", index) for index in range(EPISODES)]
    return [run_episode(s, PushThrough(), protocol=protocol).steps for s in scenes]


def _killed(folder: Path, rng: random.Random) -> dict[str, int]:
    """Run a child and kill it; return the steps it had written, by log."""
    child = subprocess.Popen(
        [sys.executable, "-c", CHILD, str(folder)],
        cwd=REPOSITORY,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert child.stdout is not None
    lines = []
    for _ in range(rng.randint(1, EPISODES * STEPS - 2)):
        lines.append(child.stdout.readline())
    time.sleep(rng.uniform(0.0, 0.01))
    os.kill(child.pid, signal.SIGKILL)
    lines += child.stdout.readlines()
    child.wait()
    child.stdout.close()
    whole = (line.split() for line in lines if line.endswith("\n"))
    return {name: int(step) for name, step in whole}


@pytest.mark.parametrize("seed", KILLS)
def test_sigkill_at_a_random_moment(
    tmp_path: Path, live: list[list[StepRecord]], seed: int
) -> None:
    written = _killed(tmp_path, random.Random(seed))
    assert written
    last = max(written, key=int)
    for name, steps in written.items():
        whole, part = tmp_path / f"{name}.mcap", tmp_path / f"{name}.mcap.part"
        if name != last:
            assert read_log(whole).finished
        path = whole if whole.exists() else part
        found = read_trace(path).steps
        assert len(found) >= steps - SECOND, name
        assert len(found) > 0 or steps < SECOND
        assert difference(live[int(name)][: len(found)], found) is None
    for part in set(tmp_path.iterdir()) - {tmp_path / f"{n}.mcap" for n in written}:
        # The next episode may have begun without having told of a step.
        if part.name.split(".")[0] not in written:
            with suppress(LogError):  # Not even its beginning is whole.
                assert read_log(part).steps <= 1
