"""How long a D* Lite replan takes on a 5 cm grid where obstacles keep appearing."""

import os
import time
from collections.abc import Callable

import numpy as np
import pytest

from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.motion.grid_route import GridRoute
from beacon_mj.motion.path_tracking import remainder
from beacon_mj.motion.string_pulling import shorten
from tests.kinematics import box, disc, make_task

COMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") == "0"


def replan_times(seed: int, count: int = 25) -> tuple[Array, int]:
    """Drive east while obstacles appear; seconds of each replan, and expansions."""
    rng = np.random.default_rng(seed)
    route = GridRoute(make_task((0.5, 3.0), (5.5, 3.0)), 0.05, 0.135)
    known: list[Footprint] = []
    times = np.empty(count)
    position = np.array([0.5, 3.0])
    for i in range(count):
        x = min(position[0] + rng.uniform(0.5, 1.1), 4.9)
        y = rng.uniform(0.5, 5.5)
        square = box(x, y, x + 0.2, y + 0.2)
        known.append(square if i % 2 else disc(x, y, 0.15))
        footprints = Footprints.stack(known)
        begin = time.perf_counter()
        path = route.plan(position, footprints)
        assert path is not None
        path = shorten(path, footprints, 0.135)
        times[i] = time.perf_counter() - begin
        position = remainder(path, 0.15)[0]
    return times, route.expansions


@pytest.mark.skipif(not COMPILED, reason="speed means nothing without compilation")
def test_bench_replan(benchmark: Callable[..., tuple[Array, int]]) -> None:
    replan_times(0)
    _, expansions = benchmark(replan_times, 1)
    assert expansions > 0
