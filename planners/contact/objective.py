"""The composite objective J of paper II.E, over candidate actions.

    J(q) = J_pos(q) + J_risk(q) + J_vel(q) + J_res(q)

A candidate is a push or a way round; its state x(q) is where it ends, its velocity
v(q) how it starts. Contact energies are divided by the protocol's motion cost, so that
w_e weighs them in metres of free travel, as w_d weighs distance.
"""

import math
from dataclasses import dataclass

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import Observation, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.planners.checks import expect
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.contact.limits import PushLimits


@dataclass(frozen=True, kw_only=True, slots=True)
class Candidate:
    """One element of Q_t.

    Attributes:
        end_m: x(q), shape (2,) [m].
        velocity_mps: v(q), shape (2,) [m/s].
        distance_m: d(q), length of the way to `end_m` [m].
        time_s: T(q), time it takes [s].
        risk: Expected interaction risk, sum of b(c) R(c).
        push_energy_j: E of the contact, 0 without [J].
        normal: Unit normal of the contact, out of the obstacle, None without.
    """

    end_m: Array
    velocity_mps: Array
    distance_m: float
    time_s: float
    risk: float
    push_energy_j: float = 0.0
    normal: Array | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class Weights:
    """Weights of J; all >= 0.

    w_e is Table I's; the paper does not state the others. They are chosen so that J
    counts about one per metre of travel.
    """

    #: Weight of the position term (w_p).
    w_p: float = 1.0
    #: Weight of the risk term at full battery (w_r scale).
    w_r_scale: float = 1.0
    #: Weight of the velocity term at full battery (w_v floor).
    w_v_floor: float = 0.05
    #: What the velocity term gains until the battery is empty (w_v range).
    w_v_range: float = 0.1
    #: Weight of distance, per metre (w_d).
    w_d: float = 1.0
    #: Weight of time, per second (w_t).
    w_t: float = 0.3
    #: Weight of contact energy (w_e).
    w_e: float = 1.0

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a weight is negative or not finite.
        """
        for name in self.__slots__:
            value = getattr(self, name)
            expect(name, value, "finite and >= 0", math.isfinite(value) and value >= 0)


def objective(
    q: Candidate,
    observation: Observation,
    task: Task,
    weights: Weights,
    *,
    battery_reweighting: bool = True,
) -> dict[str, float]:
    """Return the four terms of J for one candidate.

    J_pos = w_p (|x(q) - x_g| + theta_head), J_risk = w_r E_b[R],
    J_vel = w_v (1 - cos theta_post), J_res = w_d d + w_t T + w_e 1_push E, with
    w_r = w_r_scale beta and w_v = w_v_floor + w_v_range (1 - beta) (paper II.E).

    Args:
        q: The candidate.
        observation: For the position and the battery beta.
        task: For goal and motion cost.
        weights: The weights.
        battery_reweighting: False keeps beta at one (an ablation).
    """
    beta = observation.battery if battery_reweighting else 1.0
    to_goal = task.goal_m - observation.position_m
    heading = _angle(q.velocity_mps, to_goal)
    after = q.velocity_mps if q.normal is None else _reflected(q.velocity_mps, q.normal)
    w_v = weights.w_v_floor + weights.w_v_range * (1.0 - beta)
    energy = q.push_energy_j / max(task.motion_cost_jpm, 1e-9)
    remaining = float(np.hypot(*(q.end_m - task.goal_m)))
    return {
        "pos": weights.w_p * (remaining + heading),
        "risk": weights.w_r_scale * beta * q.risk,
        "vel": w_v * (1.0 - math.cos(_angle(after, to_goal))),
        "res": weights.w_d * q.distance_m
        + weights.w_t * q.time_s
        + weights.w_e * energy,
    }


def push_candidate(
    observation: Observation,
    task: Task,
    plan: PushPlan,
    limits: PushLimits,
    *,
    risk: float,
    energy_j: float,
) -> Candidate:
    """Return the candidate of a push: approach, touch, and travel."""
    here = observation.position_m
    return Candidate(
        end_m=plan.end_m,
        velocity_mps=limits.push_mps * plan.direction,
        distance_m=plan.lead_m(here) + plan.travel_m,
        time_s=plan.lead_s(here, task) + plan.travel_m / limits.push_mps,
        risk=risk,
        push_energy_j=energy_j,
        normal=-plan.direction,
    )


def detour_candidate(
    observation: Observation, task: Task, detour: FreeRoute
) -> Candidate | None:
    """Return the candidate of the way round, or None if there is no way.

    It ends at the path's last corner, from where the goal is in sight.
    """
    left = detour.left()
    if left is None:
        return None
    corner = left[-2] if len(left) > 1 else left[-1]
    onward = float(np.hypot(*(left[-1] - corner)))
    distance = max(detour.length_m - onward, 0.0)
    first = left[1] - observation.position_m if len(left) > 1 else np.zeros(2)
    size = max(float(np.hypot(*first)), 1e-9)
    return Candidate(
        end_m=corner,
        velocity_mps=task.speed_mps * first / size,
        distance_m=distance,
        time_s=distance / task.speed_mps,
        risk=0.0,
    )


def _angle(a: Array, b: Array) -> float:
    """Unsigned angle between two vectors [rad]; zero if one vanishes."""
    norm = math.hypot(*a) * math.hypot(*b)
    if norm < 1e-12:
        return 0.0
    return math.acos(min(1.0, max(-1.0, float(a @ b) / norm)))


def _reflected(velocity: Array, normal: Array) -> Array:
    """Return a velocity after reflection from a contact normal."""
    return np.asarray(velocity - 2.0 * float(velocity @ normal) * normal)
