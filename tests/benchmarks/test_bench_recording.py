"""What a log costs while an episode runs.

`BENCH_SCENES=10 pytest tests/benchmarks/test_bench_recording.py -s -n 0` prints the
processor time of docs/logs.md; without the variable one scene a family runs.
"""

import os
import time
from pathlib import Path

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from beacon_mj.episode.run import run_episode
from beacon_mj.episode.trace import StepRecord, Trace
from beacon_mj.interface import Observation
from beacon_mj.planners.registry import load_planner
from beacon_mj.recording import Recorder
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import BaseWorld
from tests.worlds import FAMILIES

SCENES = int(os.environ.get("BENCH_SCENES", "1"))  #: Scenes of each family.


class Timed(Recorder):
    """A recorder that adds up its own processor time [s]."""

    opening_s = steps_s = 0.0

    def begin(self, trace: Trace, world: BaseWorld, observation: Observation) -> None:
        begin = time.process_time()
        super().begin(trace, world, observation)
        self.opening_s += time.process_time() - begin

    def step(
        self, record: StepRecord, world: BaseWorld, observation: Observation
    ) -> None:
        begin = time.process_time()
        super().step(record, world, observation)
        self.steps_s += time.process_time() - begin

    def end(self, trace: Trace) -> None:
        begin = time.process_time()
        super().end(trace)
        self.steps_s += time.process_time() - begin


def recorded(planner: str, folder: Path, seed: int, scenes: int) -> list[float]:
    """Return the number of logs, of steps, and the time of opening and of steps [s]."""
    logs, steps, opening_s, steps_s = 0, 0, 0.0, 0.0
    for family in FAMILIES:
        for index in range(scenes):
            recorder = Timed(folder / f"{family}-{seed}-{index}.mcap")
            scene = generate_scene(family, index, seed)
            trace = run_episode(scene, load_planner(planner)[1](), listeners=[recorder])
            logs, steps = logs + 1, steps + len(trace.steps)
            opening_s += recorder.opening_s
            steps_s += recorder.steps_s
    return [logs, steps, opening_s, steps_s]


@pytest.mark.parametrize("planner", ["beacon", "bug2"])
def test_bench_recording(
    benchmark: BenchmarkFixture, planner: str, tmp_path: Path
) -> None:
    recorded(planner, tmp_path, 1000, 1)  # Compiled before anything is timed.
    found = benchmark.pedantic(  # type: ignore[no-untyped-call]
        recorded, (planner, tmp_path, 0, SCENES), rounds=1
    )
    logs, steps, opening_s, steps_s = found
    assert len([*tmp_path.glob("*-0-*.mcap")]) == logs
    line = (
        f"{steps:.0f} steps, {1e3 * steps_s / steps:.3f} ms a step, "
        f"{1e3 * opening_s / logs:.1f} ms to open a log"
    )
    benchmark.extra_info["recording"] = line
    print(f"\n{planner}: {line}", end="")
