"""How long planners take to decide on the default scenes, seed 0.

`BENCH_SCENES=100 pytest tests/benchmarks/test_bench_decisions.py -s -n 0` prints the
percentiles of docs/planners.md; without the variable two scenes a family run.
"""

import os

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.geometry import Array
from beacon_mj.planners.registry import load_planner
from beacon_mj.scene_gen.generate import generate_scene
from tests.worlds import FAMILIES

#: Kernels may be compiled within the first decisions.
PATIENT = Protocol(decision_limit_s=3600.0)
SCENES = int(os.environ.get("BENCH_SCENES", "2"))  #: Scenes of each family.


def decisions(planner: str, seed: int, scenes: int) -> Array:
    """Return the time of each decision [ms], and whether it replanned, (n, 2)."""
    cls = load_planner(planner)[1]
    rows = [
        (1e3 * step.decision_s, step.command.info.replanned)
        for family in FAMILIES
        for index in range(scenes)
        for scene in [generate_scene(family, index, seed)]
        for step in run_episode(scene, cls(), protocol=PATIENT).steps
    ]
    return np.array(rows, dtype=float)


@pytest.mark.parametrize("planner", ["dstar-lite", "beacon", "beacon-voi"])
def test_bench_decisions(benchmark: BenchmarkFixture, planner: str) -> None:
    decisions(planner, 1000, 1)  # Compiled before anything is timed.
    taken = benchmark.pedantic(  # type: ignore[no-untyped-call]
        decisions, (planner, 0, SCENES), rounds=1
    )
    replans = taken[taken[:, 1] > 0.0]
    assert 0 < len(replans) < len(taken)
    for kind, times in (("decisions", taken[:, 0]), ("replans", replans[:, 0])):
        middle, high = np.percentile(times, [50, 99])
        line = f"n {len(times)}, median {middle:.2f} ms, p99 {high:.2f} ms"
        benchmark.extra_info[kind] = line
        print(f"\n{planner} {kind}: {line}", end="")
