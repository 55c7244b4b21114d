"""The dm_env environments: dm_env's own conformance tests, and equal physics."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import BeaconError
from beacon_mj.world import World
from tests.worlds import cached_scene

pytest.importorskip("dm_control", reason="no dm-control here")
from dm_env import StepType, test_utils

from beacon_mj import dm_suite

EAST = np.array([1.0, 0.25], np.float32)


class Conformance(test_utils.EnvironmentTestMixin):  # type: ignore[misc]
    """dm_env's tests, on an environment whose episodes end within a sequence."""

    def make_object_under_test(self) -> Any:
        return dm_suite.load("cluttered", 0, protocol=Protocol(max_steps=12))

    def make_action_sequence(self) -> Iterator[Any]:
        return iter([EAST] * 30)


# absltest.TestCase brings the assertions that the mixin calls.
from absl.testing import absltest  # noqa: E402


class TestConformance(Conformance, absltest.TestCase):
    """Collected by pytest."""


@pytest.mark.parametrize("index", [0, 3])
def test_physics_is_that_of_our_world(index: int) -> None:
    env = dm_suite.load("collision-required", index, seed=0)
    world = World(cached_scene("collision-required", index))
    env.reset()
    touched = False
    for _ in range(60):
        env.step(EAST)
        outcome = world.step(world.scene.robot.speed_mps * EAST.astype(np.float64))
        touched |= bool(outcome.contacts)
        assert np.array_equal(env.physics.data.qpos, world.data.qpos)
        assert np.array_equal(env.physics.data.qvel, world.data.qvel)
    assert touched
    assert env.physics.named.data.xpos["base"].shape == (3,)
    assert env.physics.timestep() == 0.002
    assert env.control_timestep() == 0.1


def test_episodes_of_a_scene_are_the_same_and_have_rows() -> None:
    env = dm_suite.load("sparse", 2, protocol=Protocol(max_steps=10))
    ends = []
    for _ in range(2):
        step = env.reset()
        with pytest.raises(BeaconError, match="the end of an episode before its row"):
            _ = env.row
        while not step.last():
            step = env.step(EAST)
        ends.append((step.observation["goal"].tolist(), env.row.path_length_m))
        assert (step.discount, env.row.outcome) == (1.0, "timeout")
    assert ends[0] == ends[1]
    assert env.step(EAST).step_type is StepType.FIRST


def test_a_goal_that_is_reached_ends_with_a_discount_of_zero() -> None:
    env = dm_suite.load("sparse", 2, protocol=Protocol(goal_tolerance_m=1.0))
    step = env.reset()
    while not step.last():
        x, y, distance = step.observation["goal"]
        step = env.step(np.array([x, y], np.float32) / distance)
    assert (env.row.outcome, step.discount) == ("reached", 0.0)
    assert step.reward > 9.0
