"""Speed of the world: quiet steps, pushing steps, and building it."""

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.sensor import Sensor
from beacon_mj.fidelity.benches import bench, block
from beacon_mj.world import World
from tests.worlds import cached_scene

REST = np.zeros(2)


def test_quiet_step(benchmark: BenchmarkFixture) -> None:
    world = World(cached_scene("cluttered", 0))
    outcome = benchmark(world.step, REST)
    assert not outcome.contacts


def test_engine_alone_for_a_quiet_step(benchmark: BenchmarkFixture) -> None:
    """What `mj_step` takes of the quiet step."""
    import mujoco

    world = World(cached_scene("cluttered", 0))
    benchmark(mujoco.mj_step, world.model, world.data, nstep=50)
    assert world.data.ntree_awake == 1


def test_pushing_step(benchmark: BenchmarkFixture) -> None:
    """All force against what does not move, so that every step is the same."""
    world = World(bench(block(gap_m=0.0, mass_kg=20.0)))
    ahead = np.array([0.3, 0.0])
    outcome = benchmark(world.step, ahead)
    assert outcome.contacts


def test_watched_step_without_contact(benchmark: BenchmarkFixture) -> None:
    world = World(cached_scene("cluttered", 0), watch=lambda: None)
    outcome = benchmark(world.step, REST)
    assert not outcome.contacts


@pytest.mark.parametrize("radius", [1.0, 10.0])
def test_observe(benchmark: BenchmarkFixture, radius: float) -> None:
    world = World(cached_scene("cluttered", 0))
    sensor = Sensor(world, Protocol(sensing_radius_m=radius))
    outcome = world.step(REST)
    observation = benchmark(sensor.observe, outcome, 1.0)
    assert observation.step == 1


def test_build(benchmark: BenchmarkFixture) -> None:
    world = benchmark(World, cached_scene("cluttered", 0))
    assert len(world.poses) >= 18


def test_reset(benchmark: BenchmarkFixture) -> None:
    world = World(cached_scene("cluttered", 0))
    benchmark(world.reset)
    assert world.data.time == 0.0
