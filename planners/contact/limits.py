"""How fast and how hard a push may be, by what may break."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from beacon_mj.interface import SensedObstacle, Task
from beacon_mj.planners.contact.push_model import gentle_speed_mps

#: Probability of being fragile below which nothing is expected to break.
SURE = 0.02
_TOUCH_MPS = (0.05, 0.25)  #: Slowest and fastest touch of what may break [m/s].
_HEADROOM = 1.6  #: Force limit over the force that is needed.


@dataclass(frozen=True, kw_only=True, slots=True)
class PushLimits:
    """How a push is carried out; the same for all planners that push.

    Attributes:
        touch_mps: Speed at which the bumper meets the obstacle [m/s].
        push_mps: Speed of the push [m/s].
        ramp_mps2: Acceleration from one to the other [m/s^2].
        force_limit_n: Bumper force above which the push slows down [N]; infinite for
            obstacles that will not break.
    """

    touch_mps: float
    push_mps: float
    ramp_mps2: float = 0.6
    force_limit_n: float = float("inf")


class Care(Protocol):
    """How careful a planner is: the fields of its configuration that say so."""

    @property
    def gentle_force_n(self) -> float:
        """Force that a touch may have where something may break [N]."""

    @property
    def fragile_force_n(self) -> float:
        """Bumper force above which such a push slows down [N], if it needs no more."""

    @property
    def push_speed_mps(self) -> float:
        """Speed of a push [m/s]."""


def careful_limits(
    obstacle: SensedObstacle, need_n: float, fragility: float, task: Task, care: Care
) -> PushLimits:
    """Return the limits of a push: gentle where something may break.

    Args:
        obstacle: What is pushed; its perceived mass decides how hard a touch is.
        need_n: Force that is expected to move it [N].
        fragility: Largest probability of being fragile of what would move.
        task: The robot.
        care: How careful to be.
    """
    if fragility < SURE:
        return PushLimits(touch_mps=care.push_speed_mps, push_mps=care.push_speed_mps)
    mass = obstacle.density_kgm3 * obstacle.volume_m3
    gentle = gentle_speed_mps(
        care.gentle_force_n, mass, task.mass_kg, task.bumper_stiffness_npm
    )
    return PushLimits(
        touch_mps=float(np.clip(gentle, *_TOUCH_MPS)),
        push_mps=care.push_speed_mps,
        ramp_mps2=0.5,
        force_limit_n=max(care.fragile_force_n, _HEADROOM * need_n),
    )
