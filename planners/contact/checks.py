"""Guards of a push while it goes on: is the way clear, what is about to be struck?

(`beacon_mj.planners.checks` checks configurations.)
"""

import math

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import Observation, SensedObstacle, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.planners.contact.candidates import PushPlan, nearby
from beacon_mj.planners.contact.push_model import PushWorld

_CLEAR_SLACK_M = 0.3  #: A free way this much longer than planned ends a push [m].
_LOOK_AHEAD_M = 0.2  #: Travel ahead of a push that is watched [m].
_TURNS = (0.0, -0.06, 0.06)  #: Directions that it may take instead [rad].


def stands_free(observation: Observation, plan: PushPlan, task: Task) -> bool:
    """Whether nothing stands where the push is to begin."""
    gaps = observation.footprints.distance(plan.approach_m) - task.radius_m
    return bool(gaps.min() > 0.0)


def way_is_clear(
    observation: Observation, plan: PushPlan, free: FreeRoute, task: Task
) -> bool:
    """Whether the disc can now go on freely, about as directly as planned."""
    free.update(observation)
    ahead = float(np.hypot(*(plan.end_m - observation.position_m)))
    onward = float(np.hypot(*(task.goal_m - plan.end_m)))
    return free.length_m < ahead + onward + _CLEAR_SLACK_M


def next_in_chain(
    observation: Observation, plan: PushPlan, task: Task
) -> list[SensedObstacle]:
    """Return what may move if the push goes on a little, the pushed obstacle first.

    What lies behind an obstacle is often seen only once the push has begun, and an
    obstacle turns a little as it goes: a neighbour just beside its way counts as well.
    """
    near = nearby(observation, plan.index, _LOOK_AHEAD_M)
    world = PushWorld([observation.obstacles[i] for i in near])
    moved: dict[int, None] = {}
    for turn in _TURNS:
        travel = _LOOK_AHEAD_M * _turned(plan.direction, turn)
        cascade = world.cascade(
            0, travel, lambda i: 0.0, task.force_max_n, lambda i: False
        )
        moved |= dict.fromkeys(i for i, _ in cascade.moved)
    return [observation.obstacles[near[i]] for i in moved]


def _turned(direction: Array, angle: float) -> Array:
    """Return a vector (2,) turned counter-clockwise by an angle [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]]) @ direction
