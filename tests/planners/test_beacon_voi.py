"""BEACON-VOI: its probabilities, its expected times, and its runs."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.episode.run import run_episode
from beacon_mj.errors import PlannerError
from beacon_mj.interface import PushEvidence, SensedObstacle
from beacon_mj.planners.beacon_voi import BeaconVoi, BeaconVoiConfig, BeaconVoiPolicy
from beacon_mj.planners.contact.cost_to_go import TravelTimes
from beacon_mj.scene_gen.generate import generate_scene
from tests.kinematics import make_task
from tests.sensed import observe, sensed_box

TASK = make_task((1.0, 3.0), (5.0, 3.0))
SEED = 4000


def policy_with(*boxes: SensedObstacle) -> BeaconVoiPolicy:
    policy = BeaconVoiPolicy()
    policy.reset(TASK)
    policy.observe(observe((1.0, 3.0), *boxes))
    return policy


def box_of_force(force_n: float, safe: float) -> SensedObstacle:
    density = force_n / (0.5 * 9.81 * 0.036)
    return sensed_box("a", density=density, scores=(safe, 1.0 - safe, 0.0))


def test_chance_at_the_limit_is_half_of_what_gives_way() -> None:
    box = box_of_force(60.0, safe=0.2)
    assert policy_with(box).chance(box) == pytest.approx(0.4)


@given(st.floats(1.0, 200.0), st.floats(0.0, 1.0))
def test_chance_is_the_normal_tail(force: float, safe: float) -> None:
    box = box_of_force(force, safe)
    sampled = np.random.default_rng(0).normal(math.log(force), 0.21, 4000)
    expected = (1.0 - safe) * float((sampled < math.log(60.0)).mean())
    assert policy_with(box).chance(box) == pytest.approx(expected, abs=0.04)


def test_what_has_moved_once_is_a_matter_of_class_alone() -> None:
    box = box_of_force(59.0, safe=0.5)
    policy = policy_with(box)
    before = policy.chance(box)
    assert policy.learn(PushEvidence("a", "moved", 30.0, 1.0))
    assert policy.chance(box) > 0.95 > before


@given(st.floats(1.0, 200.0), st.floats(0.0, 1.0))
def test_only_what_hardly_gives_way_waits_for_the_last_resort(
    force: float, safe: float
) -> None:
    box = box_of_force(force, safe)
    policy = policy_with(box)
    cost = policy.crossing_cost(box, last_resort=False)
    last = policy.crossing_cost(box, last_resort=True)
    assert last is not None
    assert (cost is None) == (policy.chance(box) < policy.config.least_chance)
    assert cost in (None, last)


def test_times_over_an_empty_room_are_straight() -> None:
    times = TravelTimes(TASK, unknown_premium=0.0)
    times.update(observe((1.0, 3.0)), {})
    straight_s = 4.0 / TASK.speed_mps
    assert times.from_point(np.array([1.0, 3.0])) == pytest.approx(straight_s, rel=0.05)


def test_unknown_space_costs_its_premium_until_it_is_seen() -> None:
    times = TravelTimes(TASK, unknown_premium=0.5)
    times.update(observe((1.0, 3.0)), {})
    unknown = times.from_point(np.array([1.0, 3.0]))
    for x in np.arange(0.5, 5.6, 0.5):
        times.note_range(np.array([x, 3.0]))
    times.update(observe((1.0, 3.0)), {})
    known = times.from_point(np.array([1.0, 3.0]))
    assert unknown == pytest.approx(1.5 * known, rel=0.05)


def test_a_closed_room_has_no_time() -> None:
    wall = sensed_box("a", 3.0, 3.0, length=0.2, width=6.0)
    times = TravelTimes(TASK, unknown_premium=0.0)
    times.update(observe((1.0, 3.0), wall), {})
    assert math.isinf(times.from_point(np.array([1.0, 3.0])))


def test_what_may_be_pushed_can_be_gone_through_at_its_cost() -> None:
    """A wall of half width w: the integral of (R + w - |x|) / 2 R over the crossing."""
    wall = sensed_box("a", 3.0, 3.0, length=0.2, width=6.0)
    times = TravelTimes(TASK, unknown_premium=0.0)
    times.update(observe((1.0, 3.0), wall), {0: 10.0})
    start = np.array([1.0, 3.0])
    assert math.isinf(times.from_point(start))
    added_s = times.through(start) - 4.0 / TASK.speed_mps
    room_m = TASK.radius_m + 0.005
    expected_m = 10.0 * (room_m + 0.1) ** 2 / (2.0 * room_m)
    assert added_s * TASK.speed_mps == pytest.approx(expected_m, rel=0.1)


def test_the_time_to_a_place_is_that_of_the_way_there() -> None:
    """Round the end of a wall: two straight lines about its corner."""
    wall = sensed_box("a", 3.0, 2.0, length=0.2, width=4.0)
    times = TravelTimes(TASK, unknown_premium=0.3)
    times.update(observe((2.5, 1.0), wall), {})
    r = TASK.radius_m
    way_m = 2.0 * math.dist((2.5, 1.0), (2.9 - r, 4.0 + r)) + 0.2 + 2.0 * r
    way_s = times.to_point(np.array([3.5, 1.0]))
    assert way_s == pytest.approx(way_m / TASK.speed_mps, rel=0.12)


def test_a_near_door_is_tried_though_further_barriers_follow() -> None:
    """Neither the way to a door nor that beyond it is a straight line there."""
    trace = run_episode(generate_scene("unweighed-doors", 40, seed=1000), BeaconVoi())
    assert trace.outcome == "reached"
    assert len(trace.steps) < 400  # 535 when it always took the far and light door.


@pytest.mark.parametrize("family", ["collision-required", "collision-shortcut"])
def test_barriers_are_crossed_cleanly(family: str) -> None:
    trace = run_episode(generate_scene(family, 0, seed=SEED), BeaconVoi())
    assert trace.outcome == "reached"
    assert not any(s.outcome.damages for s in trace.steps)
    assert any(s.outcome.attempts for s in trace.steps)


def test_config_is_checked() -> None:
    with pytest.raises(PlannerError, match="Expected least_chance to be between"):
        BeaconVoiConfig(least_chance=2.0)
