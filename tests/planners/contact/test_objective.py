"""The objective J against the paper's equations, term by term."""

import math

import numpy as np
import pytest

from beacon_mj.errors import PlannerError
from beacon_mj.planners.contact.objective import Candidate, Weights, objective
from tests.kinematics import make_task
from tests.sensed import observe

TASK = make_task((1.0, 3.0), (5.0, 3.0))  # motion_cost_jpm is 1 J/m there.
WEIGHTS = Weights(
    w_p=2.0, w_r_scale=3.0, w_v_floor=0.5, w_v_range=0.4, w_d=1.5, w_t=0.25, w_e=4.0
)


def candidate(**changes: object) -> Candidate:
    values: dict[str, object] = {
        "end_m": np.array([2.0, 3.0]),
        "velocity_mps": np.array([0.5, 0.0]),
        "distance_m": 1.0,
        "time_s": 2.0,
        "risk": 0.2,
    }
    return Candidate(**(values | changes))  # type: ignore[arg-type]


def test_straight_ahead_without_contact() -> None:
    terms = objective(candidate(), observe((1.0, 3.0)), TASK, WEIGHTS)
    assert terms["pos"] == pytest.approx(2.0 * 3.0)
    assert terms["risk"] == pytest.approx(3.0 * 0.2)
    assert terms["vel"] == pytest.approx(0.0)
    assert terms["res"] == pytest.approx(1.5 * 1.0 + 0.25 * 2.0)


def test_heading_adds_its_angle() -> None:
    north = candidate(velocity_mps=np.array([0.0, 0.5]))
    terms = objective(north, observe((1.0, 3.0)), TASK, WEIGHTS)
    assert terms["pos"] == pytest.approx(2.0 * (3.0 + math.pi / 2))
    assert terms["vel"] == pytest.approx(0.5)


def test_head_on_contact_reflects_backwards() -> None:
    push = candidate(normal=np.array([-1.0, 0.0]), push_energy_j=10.0)
    terms = objective(push, observe((1.0, 3.0)), TASK, WEIGHTS)
    assert terms["vel"] == pytest.approx(0.5 * 2.0)
    assert terms["res"] == pytest.approx(2.0 + 4.0 * 10.0)


def test_battery_shifts_risk_to_alignment() -> None:
    push = candidate(normal=np.array([-1.0, 0.0]))
    low = observe((1.0, 3.0), battery=0.25)
    terms = objective(push, low, TASK, WEIGHTS)
    assert terms["risk"] == pytest.approx(3.0 * 0.25 * 0.2)
    assert terms["vel"] == pytest.approx((0.5 + 0.4 * 0.75) * 2.0)
    still = objective(push, low, TASK, WEIGHTS, battery_reweighting=False)
    assert still["risk"] == pytest.approx(3.0 * 0.2)


@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf])
def test_weights_are_checked(value: float) -> None:
    with pytest.raises(PlannerError, match="Expected w_t to be finite and >= 0"):
        Weights(w_t=value)
