"""What the loop remembers of failed pushes, and for how long."""

import dataclasses

import pytest

from beacon_mj.interface import PushEvidence
from beacon_mj.planners.beacon import Beacon, BeaconConfig
from beacon_mj.planners.contact.attempts import Attempts
from beacon_mj.planners.contact.belief_settings import FORGET_S, BeliefSettings, Memory
from tests.kinematics import make_task
from tests.sensed import observe, sensed_box

BOX = sensed_box("a")


def after_failure(memory: Memory, now_s: float) -> Attempts:
    """Return what is left `now_s` [s] into an episode in which a push failed at 5 s."""
    attempts = Attempts(BeliefSettings(memory=memory).failures_last_s)
    attempts.learn(PushEvidence("a", "not_moved", 55.0, 5.0))
    at = dataclasses.replace(observe((1.0, 3.0), BOX), time_s=5.0)
    attempts.ended("a", at, failed=True)
    attempts.forget(now_s)
    return attempts


@pytest.mark.parametrize("memory", ["none", "failures", "belief"])
def test_a_failure_is_remembered_for_a_while(memory: Memory) -> None:
    assert after_failure(memory, 5.0 + FORGET_S).immovable(BOX)


@pytest.mark.parametrize(
    ("memory", "remembered"), [("none", False), ("failures", True), ("belief", True)]
)
def test_only_memory_none_forgets(memory: Memory, remembered: bool) -> None:
    attempts = after_failure(memory, 5.1 + FORGET_S)
    assert attempts.immovable(BOX) is remembered
    # One more failure that is no proof does not bring the old ones back.
    late = dataclasses.replace(observe((1.0, 3.0), BOX), time_s=20.0)
    attempts.ended("a", late, failed=True)
    assert attempts.immovable(BOX) is remembered


@pytest.mark.parametrize("memory", ["none", "failures"])
def test_the_loop_keeps_failures_as_its_policy_says(memory: Memory) -> None:
    planner = Beacon(BeaconConfig(belief=BeliefSettings(memory=memory)))
    planner.reset(make_task((1.0, 3.0), (5.0, 3.0)))
    failure = PushEvidence("a", "not_moved", 55.0, 0.0)
    seen = observe((1.0, 3.0), BOX)
    for time_s, evidence in ((0.1, (failure,)), (9.9, ()), (10.1, ())):
        planner.act(dataclasses.replace(seen, time_s=time_s, evidence=evidence))
        remembered = time_s < FORGET_S or memory == "failures"
        assert planner._memory.attempts.immovable(BOX) is remembered
