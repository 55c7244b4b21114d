"""How fast and how hard a push may be, by what may break."""

from dataclasses import dataclass

import numpy as np

from beacon_mj.interface import SensedObstacle, Task
from beacon_mj.planners.checks import expect_between
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


@dataclass(frozen=True, kw_only=True, slots=True)
class PushSettings:
    """How fast a planner pushes, and how careful it is where something may break."""

    #: Speed of a push [m/s].
    speed_mps: float = 0.5
    #: Touching force that is allowed where something may break [N].
    gentle_force_n: float = 10.0
    #: Bumper force above which a push of something that may break slows down [N].
    fragile_force_n: float = 14.0

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        expect_between("speed_mps", self.speed_mps, 0.01, 5.0)
        expect_between("gentle_force_n", self.gentle_force_n, 0.1, 1000.0)
        expect_between("fragile_force_n", self.fragile_force_n, 0.1, 1000.0)


def careful_limits(
    obstacle: SensedObstacle,
    need_n: float,
    fragility: float,
    task: Task,
    settings: PushSettings,
) -> PushLimits:
    """Return the limits of a push: gentle where something may break.

    Args:
        obstacle: What is pushed; its perceived mass decides how hard a touch is.
        need_n: Force that is expected to move it [N].
        fragility: Largest probability of being fragile of what would move.
        task: The robot.
        settings: How fast, and how careful, to be.
    """
    if fragility < SURE:
        return PushLimits(touch_mps=settings.speed_mps, push_mps=settings.speed_mps)
    mass = obstacle.density_kgm3 * obstacle.volume_m3
    gentle = gentle_speed_mps(
        settings.gentle_force_n, mass, task.mass_kg, task.bumper_stiffness_npm
    )
    return PushLimits(
        touch_mps=float(np.clip(gentle, *_TOUCH_MPS)),
        push_mps=settings.speed_mps,
        ramp_mps2=0.5,
        force_limit_n=max(settings.fragile_force_n, _HEADROOM * need_n),
    )
