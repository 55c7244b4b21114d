"""What episodes of the planar world cost in processor time, without logs.

`BENCH_SCENES=100 pytest tests/benchmarks/test_bench_planar.py -s -n 0` runs 400; the
scenes are made before anything is timed.
"""

import os
import time

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from beacon_mj.episode.run import run_episode
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.eval.studies.push_trials import WORLDS
from beacon_mj.planners.beacon import Beacon
from beacon_mj.scene import Scene
from tests.worlds import FAMILIES, cached_scene

SCENES = int(os.environ.get("BENCH_SCENES", "1"))  #: Scenes of each family.


def seconds(scenes: list[Scene], world: str) -> float:
    """Return the processor time of all episodes [s]."""
    begin = time.process_time()
    for scene in scenes:
        row = measure(run_episode(scene, Beacon(), "beacon", WORLDS[world]))
        assert row.outcome == "reached"
    return time.process_time() - begin


@pytest.mark.parametrize("world", [*WORLDS])
def test_bench_planar_episodes(benchmark: BenchmarkFixture, world: str) -> None:
    scenes = [cached_scene(family, i) for family in FAMILIES for i in range(SCENES)]
    seconds(scenes[-1:], world)  # Compiled before anything is timed.
    taken = benchmark.pedantic(  # type: ignore[no-untyped-call]
        seconds, (scenes, world), rounds=1
    )
    line = f"{1e3 * taken / len(scenes):.0f} ms an episode, n {len(scenes)}"
    benchmark.extra_info["episodes"] = line
    print(f"\n{world}: {line}", end="")
