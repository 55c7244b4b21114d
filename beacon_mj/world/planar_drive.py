"""How the disc of a planar world follows a command: the ramp of its drive.

The servo pushes with all of its force until the velocity is the commanded one, along a
straight line in velocity:

    |dv / dt| = F_max / M  until v = v*.

That is the disc of the physical world without its servo's time constant of 5 ms, so
planners that reckon with the ramp find it here too. What is pushed takes nothing off
it: pushing is quasi-static.
"""

from typing import NamedTuple

from beacon_mj.geometry import Array
from beacon_mj.numerics import dot, norm
from beacon_mj.scene import Robot


class Driven(NamedTuple):
    """What the drive does in some time.

    Attributes:
        travel_m: Displacement, if nothing is in the way, shape (2,) [m].
        velocity_mps: Velocity at the end, shape (2,) [m/s].
        work_j: Change of the kinetic energy: work of the drive [J].
        full: Whether the drive still pushes with all of its force.
    """

    travel_m: Array
    velocity_mps: Array
    work_j: float
    full: bool


def limited(velocity_mps: Array, limit_mps: float) -> Array:
    """Return a command scaled down to a speed, shape (2,) [m/s]."""
    speed = norm(velocity_mps)
    return velocity_mps * (limit_mps / speed) if speed > limit_mps else velocity_mps


def driven(velocity: Array, command: Array, robot: Robot, time_s: float) -> Driven:
    """Return what the drive does in `time_s`, from a velocity towards a command.

    Args:
        velocity: Velocity at the start, shape (2,) [m/s].
        command: Commanded velocity, shape (2,) [m/s].
        robot: The robot.
        time_s: Time [s].
    """
    change = command - velocity
    size, gain = norm(change), robot.force_max_n / robot.mass_kg
    if size == 0.0 and not change.any():
        return Driven(time_s * command, command, 0.0, False)
    ramp_s = size / gain
    if ramp_s <= time_s:
        # The mean velocity of the ramp, then the command.
        travel = 0.5 * ramp_s * (velocity + command) + (time_s - ramp_s) * command
        end, full = command, False
    else:
        end, full = velocity + change * (time_s / ramp_s), True
        travel = 0.5 * time_s * (velocity + end)
    work = 0.5 * robot.mass_kg * (dot(end, end) - dot(velocity, velocity))
    return Driven(travel, end, work, full)
