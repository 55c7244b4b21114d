"""How fast and how hard a push may be, by what may break and by what is sensed.

What a planner would do is its own affair; `within_sheet` then holds every planner to
what the sensor's data sheet allows. Where the sensor is good that is no limit.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from beacon_mj.interface import SensedObstacle, SensorSheet, Task
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.contact.push_model import gentle_speed_mps

#: Probability of being fragile below which nothing is expected to break.
SURE = 0.02
_TOUCH_MPS = (0.05, 0.25)  #: Slowest and fastest touch of what may break [m/s].
_HEADROOM = 1.6  #: Force limit over the force that is needed.
#: Touch [m/s], push [m/s] and ramp [m/s^2] of what may break, where the perceived mass
#: is wrong by its own size: the standard deviation of its logarithm is one.
_DOUBTFUL = (0.06, 0.25, 0.25)
#: Speed of a push of what may break, where it hides what it may run into [m/s].
_BLIND_MPS = 0.1
_CLOSE_M = 0.003  #: Least gap within which the robot moves at touching speed [m].
_SIGMAS = 2.5  #: Room kept for an error over its standard deviation.


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


def mass_error(sheet: SensorSheet) -> float:
    """Return the standard deviation of the logarithm of a perceived mass.

    A force is friction times mass times g. Of the own errors of the two, which are
    independent and alike, mass has one; a common factor may be all mass:

        sigma_m^2 = sigma_F^2 / 2 + sigma_common^2.
    """
    own, common = sheet.force_error, sheet.force_scale_error
    return math.sqrt(0.5 * own * own + common * common)


def position_error_m(sheet: SensorSheet) -> float:
    """Return how much nearer than it is sensed an obstacle may be: 2.5 sigma [m].

    Of a hundred less than one is nearer than that. The error of the robot's own
    position does not count: what is in sight is off by as much.
    """
    return _SIGMAS * sheet.pose_noise_m


def braking_room_m(sheet: SensorSheet) -> float:
    """Return the sensed gap within which the robot moves at touching speed [m]."""
    return max(_CLOSE_M, position_error_m(sheet))


def within_sheet(
    limits: PushLimits, fragility: float, sheet: SensorSheet
) -> PushLimits:
    """Return limits that trust a perceived mass only as far as the sheet does.

    How hard a touch is grows with speed and with mass. Where something may break, the
    speeds of touch and push and the ramp between them are at most

        v_1 / sigma_m,

    with v_1 what is safe for a mass that is wrong by its own size. With an error of
    15 % that allows a touch at 0.4 m/s, which is no limit. And where obstacles hide
    others, what is pushed hides what it may run into: only the bumper tells of that,
    and 0.1 m/s leave it a control period to do so.

    Args:
        limits: What the policy would do.
        fragility: Largest probability of being fragile of what would move.
        sheet: The data sheet.
    """
    if fragility < SURE:
        return limits
    doubt = max(mass_error(sheet), 1e-9)
    touch, push, ramp = (value / doubt for value in _DOUBTFUL)
    if sheet.occlusion:
        push = min(push, _BLIND_MPS)
    return replace(
        limits,
        touch_mps=min(limits.touch_mps, touch),
        push_mps=min(limits.push_mps, push),
        ramp_mps2=min(limits.ramp_mps2, ramp),
    )
