"""How far a push trusts the sensor: the law of its data sheet, in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.geometry import Footprint
from beacon_mj.interface import SensorSheet, Task
from beacon_mj.planners.beacon import Beacon
from beacon_mj.planners.beacon_kinds import BeaconKinds
from beacon_mj.planners.beacon_voi import BeaconVoi, BeaconVoiConfig, BeaconVoiPolicy
from beacon_mj.planners.contact.belief_settings import BeliefSettings
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.contact.controller import PushController
from beacon_mj.planners.contact.limits import (
    SURE,
    PushLimits,
    braking_room_m,
    mass_error,
    position_error_m,
    within_sheet,
)
from beacon_mj.planners.contact.loop import ContactPlanner
from beacon_mj.planners.semantic import Semantic
from beacon_mj.pushing.cascade import Cascade
from tests.kinematics import make_task
from tests.sensed import observe, sensed_box

PLAIN = SensorSheet(force_error=0.21)  # That of paper-v1.
HARD = SensorSheet(range_m=0.5, occlusion=True, pose_noise_m=0.01, force_error=1.41)
FAST = PushLimits(touch_mps=0.25, push_mps=0.5, ramp_mps2=0.5, force_limit_n=14.0)
errors = st.floats(0.0, 3.0)


def sheet_of(own: float, common: float) -> SensorSheet:
    return SensorSheet(force_error=own, force_scale_error=common)


@given(own=errors, common=errors)
def test_a_mass_has_half_the_variance_of_a_force_and_all_that_is_common(
    own: float, common: float
) -> None:
    variance = mass_error(sheet_of(own, common)) ** 2
    assert variance == pytest.approx(own**2 / 2.0 + common**2)


@given(own=errors, common=errors, fragility=st.floats(SURE, 1.0))
def test_speeds_of_what_may_break_go_with_one_over_the_error(
    own: float, common: float, fragility: float
) -> None:
    sheet = sheet_of(own, common)
    found = within_sheet(FAST, fragility, sheet)
    doubt = max(mass_error(sheet), 1e-6)
    assert found.touch_mps == pytest.approx(min(0.25, 0.06 / doubt))
    assert found.push_mps == pytest.approx(min(0.5, 0.25 / doubt))
    assert found.ramp_mps2 == pytest.approx(min(0.5, 0.25 / doubt))
    assert found.force_limit_n == FAST.force_limit_n


@given(limits=st.floats(0.01, 0.25), fragility=st.floats(0.0, 1.0))
def test_a_good_sensor_limits_nothing(limits: float, fragility: float) -> None:
    asked = PushLimits(touch_mps=limits, push_mps=2.0 * limits, ramp_mps2=0.6)
    for sheet in (PLAIN, SensorSheet(), replace(PLAIN, pose_noise_m=0.01)):
        assert within_sheet(asked, fragility, sheet) == asked


def test_what_will_not_break_is_pushed_as_the_planner_likes() -> None:
    assert within_sheet(FAST, 0.99 * SURE, HARD) == FAST


def test_a_push_into_what_is_hidden_is_slow() -> None:
    seen, hidden = (replace(HARD, occlusion=o) for o in (False, True))
    assert within_sheet(FAST, 0.5, seen).push_mps == pytest.approx(0.25, rel=0.01)
    assert within_sheet(FAST, 0.5, hidden).push_mps == 0.1


@given(noise=st.floats(0.0, 0.1))
def test_room_to_brake_is_two_and_a_half_sigma(noise: float) -> None:
    sheet = SensorSheet(pose_noise_m=noise)
    assert position_error_m(sheet) == 2.5 * noise
    assert braking_room_m(sheet) == max(0.003, 2.5 * noise)
    assert braking_room_m(replace(sheet, robot_pose_noise_m=0.1)) == max(
        0.003, 2.5 * noise
    )


@pytest.mark.parametrize("planner", [Beacon, BeaconKinds, BeaconVoi, Semantic])
def test_every_planner_that_pushes_is_held_to_the_sheet(
    planner: type[ContactPlanner],
) -> None:
    box = sensed_box("box", 2.0, 3.0, scores=(0.1, 0.5, 0.4))
    observation = observe((1.0, 3.0), box)
    plan = plan_of(box.footprint)
    found = {}
    for name, sheet in (("plain", PLAIN), ("hard", HARD)):
        policy = planner().policy
        policy.reset(replace(make_task((1.0, 3.0), (5.0, 3.0)), sensor=sheet))
        policy.observe(observation)
        asked = policy.limits(observation, plan)
        found[name] = policy.allowed_limits(observation, plan)
        assert found[name] == within_sheet(asked, 0.4, sheet)
    assert found["plain"] == asked
    assert found["hard"].touch_mps <= 0.0602
    assert found["hard"].push_mps == 0.1


def plan_of(footprint: Footprint) -> PushPlan:
    touch = np.array([float(footprint.vertices[:, 0].min()) - 0.12, 3.0])
    east = np.array([1.0, 0.0])
    alone = Cascade(((0, 0.5),), 10.0, None)
    return PushPlan(0, "box", east, touch - 0.06 * east, touch, 0.5, alone)


def speed_at_contact(task: Task, nearer_m: float) -> float:
    """Return how fast a box is struck that is nearer than it is sensed [m/s].

    The robot is a mass under a drive of limited force that follows its commands.
    """
    box = sensed_box("box", 2.0, 3.0, length=0.3)
    plan = plan_of(box.footprint)
    limits = PushLimits(touch_mps=0.05, push_mps=0.5)
    controller = PushController(plan, task, limits)
    x, v = 1.0, 0.0
    for step in range(200):
        now = observe((x, 3.0), box)
        now = replace(
            now, velocity_mps=np.array([v, 0.0]), step=step, time_s=0.1 * step
        )
        command = float(controller.act(now)[0])
        for _ in range(100):
            most = task.force_max_n / task.mass_kg * 0.001
            v += min(max(command - v, -most), most)
            x += v * 0.001
            if x >= plan.touch_m[0] - nearer_m:
                assert controller.phase == "touch"
                return v
    raise AssertionError("it never touched")


@given(share=st.floats(0.0, 1.0))
def test_a_box_nearer_than_sensed_is_struck_no_faster(share: float) -> None:
    noise = 0.01
    task = replace(
        make_task((1.0, 3.0), (5.0, 3.0)), sensor=SensorSheet(pose_noise_m=noise)
    )
    assert speed_at_contact(task, share * 2.5 * noise) <= 0.055


def test_without_that_room_it_would_be() -> None:
    task = make_task((1.0, 3.0), (5.0, 3.0))
    assert speed_at_contact(task, 0.0) <= 0.055
    assert speed_at_contact(task, 0.025) > 0.15


def voi(sheet: SensorSheet, **fields: float | None) -> BeaconVoiPolicy:
    policy = BeaconVoiPolicy(BeaconVoiConfig(**fields))  # type: ignore[arg-type]
    policy.reset(replace(make_task((1.0, 3.0), (5.0, 3.0)), sensor=sheet))
    return policy


def test_voi_takes_from_the_sheet_what_it_is_not_told() -> None:
    unweighed = SensorSheet(force_error=0.05, force_scale_error=0.7)
    policy = voi(unweighed)
    assert policy.beliefs.force_error == 0.05
    assert policy.beliefs.settings.scale_error == 0.7
    assert len(policy.beliefs.scale.weights) > 1
    assert voi(PLAIN).beliefs.force_error == 0.21
    assert len(voi(PLAIN).beliefs.scale.weights) == 1
    assert voi(SensorSheet()).beliefs.force_error == 0.01
    told = voi(unweighed, force_error=0.3)
    assert told.beliefs.force_error == 0.3
    own = BeliefSettings(sharing=frozenset({"scale"}), scale_error=0.0)
    policy = BeaconVoiPolicy(BeaconVoiConfig(belief=own))
    policy.reset(replace(make_task((1.0, 3.0), (5.0, 3.0)), sensor=unweighed))
    assert len(policy.beliefs.scale.weights) == 1


def test_what_voi_fears_is_the_papers_on_a_good_sensor_and_more_on_a_bad_one() -> None:
    def fears(policy: BeaconVoiPolicy) -> tuple[float, float]:
        return policy._break_probability(), policy._unknown_premium()

    assert fears(voi(PLAIN)) == (0.02, 0.3)
    breaks, premium = fears(voi(HARD))
    assert breaks == pytest.approx(0.1, rel=0.01)
    assert premium == 1.0
    assert fears(voi(HARD, break_probability=0.5, unknown_premium=0.0)) == (0.5, 0.0)
