"""How fast and how hard a push may be, by what may break."""

from dataclasses import dataclass

import numpy as np

from beacon_mj.observation import SensedObstacle, Task
from beacon_mj.pushing import gentle_speed_mps

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


def gentle_limits(
    obstacle: SensedObstacle,
    need_n: float,
    task: Task,
    *,
    gentle_force_n: float,
    fragile_force_n: float,
    push_mps: float,
    ramp_mps2: float,
) -> PushLimits:
    """Return the limits for something that may break.

    Args:
        obstacle: What is pushed; its perceived mass decides how hard a touch is.
        need_n: Force that is expected to move it [N].
        task: The robot.
        gentle_force_n: Force that the touch may have [N].
        fragile_force_n: Bumper force above which the push slows down [N], if it does
            not need more.
        push_mps: Speed of the push [m/s].
        ramp_mps2: Acceleration to it [m/s^2].
    """
    mass = obstacle.density_kgm3 * obstacle.volume_m3
    gentle = gentle_speed_mps(
        gentle_force_n, mass, task.mass_kg, task.bumper_stiffness_npm
    )
    return PushLimits(
        touch_mps=float(np.clip(gentle, *_TOUCH_MPS)),
        push_mps=push_mps,
        ramp_mps2=ramp_mps2,
        force_limit_n=max(fragile_force_n, _HEADROOM * need_n),
    )
