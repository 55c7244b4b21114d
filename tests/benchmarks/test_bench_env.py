"""Speed of an environment, and of the engine alone for the same commands."""

import time

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from beacon_mj.geometry import Array
from beacon_mj.rl.navigation import Navigation
from beacon_mj.rl.options import Options
from beacon_mj.world.bare import BareWorld, ScheduledWorld
from tests.rl.policies import straight

SCENES = 4


@pytest.fixture(scope="module")
def episodes() -> Navigation:
    made = Navigation(Options(family="cluttered", indices=range(SCENES)))
    drive(made)  # Loads what is compiled.
    return made


def drive(episodes: Navigation) -> tuple[list[Array], float]:
    """Return the commands of an episode, and the processor time of its steps [s]."""
    observation, outcome = episodes.begin(), None
    began = time.process_time()
    while outcome is None:
        step = episodes.step(straight(observation))
        observation, outcome = step.observation, step.outcome
    seconds = time.process_time() - began
    assert episodes.episode is not None
    return [r.command.velocity_mps for r in episodes.episode.trace.steps], seconds


def bare(episodes: Navigation, commands: list[Array]) -> float:
    """Return the processor time of the same steps of the engine alone [s]."""
    assert episodes.episode is not None
    world = episodes.episode.world
    scheduled, engine = ScheduledWorld(world.scene), BareWorld(world.scene)
    for command in commands:
        scheduled.step(command)
    began = time.process_time()
    state = engine.run(commands, scheduled.schedules)
    seconds = time.process_time() - began
    assert np.array_equal(state, world.data.qpos)
    return seconds


def test_steps_of_an_environment(
    benchmark: BenchmarkFixture, episodes: Navigation
) -> None:
    """`extra_info` has steps a second of processor time, of both."""
    steps, seconds, engine = 0, 0.0, 0.0
    for _ in range(SCENES):
        commands, taken = drive(episodes)
        steps, seconds = steps + len(commands), seconds + taken
        engine += bare(episodes, commands)
    benchmark.extra_info["environment"] = round(steps / seconds)
    benchmark.extra_info["engine alone"] = round(steps / engine)
    assert seconds > engine
    observation = episodes.begin()
    benchmark(episodes.observer.arrays, episodes.running().observation)
    assert observation
