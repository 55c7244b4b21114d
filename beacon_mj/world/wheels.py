"""Driving on two wheels: a velocity of the plane, or (v, omega), as wheel speeds.

A holonomic planner commands a velocity in the plane. At every physics step the robot
turns towards it and drives, forwards or backwards:

    omega = sat(k e),  v = s |u| cos(e) where |e| < 30 degrees, else 0,

with the command u, the error e of the heading, and s = 1 forwards, -1 backwards. It
changes s only when e exceeds 110 degrees, and not within 0.6 s of the last change: a
command that swings about 90 degrees would else have it turn to and fro.

The wheels, of radius r at a distance b from the middle, then hold (v -+ omega b) / r.
"""

import math

import mujoco
import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.jit import kernel
from beacon_mj.numerics import norm, wrapped
from beacon_mj.scene import Robot
from beacon_mj.scene_gen.robot_contract import DifferentialDrive

TURN_GAIN_HZ = 12.0  #: k.
TURN_RATE_RADPS = 4.0  #: Largest omega.
AHEAD_RAD = math.radians(30.0)  #: Error of the heading below which it drives.
SWAP_RAD = math.radians(110.0)  #: Error of the heading above which it changes s.
SWAP_S = 0.6  #: Time within which it does not change s again.
_STILL_MPS = 1e-6  #: Speed of a command below which it asks for no direction.


class WheelDrive:
    """The two motors of a differential drive, and what tracks a command."""

    turns = True

    def __init__(
        self,
        robot: Robot,
        known: DifferentialDrive,
        model: mujoco.MjModel,
        data: mujoco.MjData,
    ) -> None:
        """Take over the actuators of `model`."""
        self._robot, self._model, self._data = robot, model, data
        self._radius_m, self._half_track_m = known.wheel_radius_m, known.half_track_m
        self._timestep_s = float(model.opt.timestep)
        sides = ("left", "right")
        self._motors = [model.actuator(f"drive_{side}").id for side in sides]
        self._dofs = [int(model.joint(f"wheel_{side}").dofadr[0]) for side in sides]
        self._gain = float(model.actuator_gainprm[self._motors[0], 0])
        self._limit_nm = float(model.actuator("drive_left").forcerange[1])
        self._yaw = int(model.joint("base_yaw").qposadr[0])
        self._yaw_rate = int(model.joint("base_yaw").dofadr[0])
        self.reset()

    def reset(self) -> None:
        """Stand still, with the nose ahead."""
        self._velocity = np.zeros(2)
        self._turn_rate: float | None = None
        self._sense, self._swapped_s = 1.0, -math.inf

    @property
    def heading_rad(self) -> float:
        """Where the nose points, counter-clockwise from east, in [-pi, pi)."""
        return wrapped(float(self._data.qpos[self._yaw]))

    @property
    def turn_rate_radps(self) -> float:
        """How fast it turns, counter-clockwise."""
        return float(self._data.qvel[self._yaw_rate])

    def limited(self, velocity_mps: Array) -> Array:
        """Return a command scaled down to the robot's speed, shape (2,) [m/s]."""
        speed, limit = norm(velocity_mps), self._robot.speed_mps
        return velocity_mps * (limit / speed) if speed > limit else velocity_mps

    def command(
        self, velocity_mps: Array, turn_rate_radps: float | None = None
    ) -> Array:
        """Hold a command for the control period that begins.

        Args:
            velocity_mps: Velocity, shape (2,), in the arena frame; with a turn rate,
                in the robot's own: forwards, and 0.
            turn_rate_radps: Turn rate; None for a velocity that is tracked.

        Returns:
            The velocity that is asked for, in the arena frame, shape (2,) [m/s].
        """
        self._velocity, self._turn_rate = velocity_mps, turn_rate_radps
        if turn_rate_radps is None:
            return velocity_mps
        limit, heading = TURN_RATE_RADPS, self.heading_rad
        self._turn_rate = min(max(turn_rate_radps, -limit), limit)
        ahead = np.array([math.cos(heading), math.sin(heading)])
        return np.asarray(velocity_mps[0] * ahead)

    def track(self) -> None:
        """Set both wheels for the physics step that comes."""
        v, omega = self._twist()
        b, r = self._half_track_m, self._radius_m
        left, right = self._motors
        self._data.ctrl[left] = (v - omega * b) / r
        self._data.ctrl[right] = (v + omega * b) / r

    @property
    def effort(self) -> float:
        """Force of the motors over their limit, in [0, 1]."""
        left, right = (abs(float(self._data.actuator_force[m])) for m in self._motors)
        return min(1.0, 0.5 * (left + right) / self._limit_nm)

    def step_work_j(self) -> float:
        """Return the work of both motors in the physics step just taken [J]."""
        data, work = self._data, 0.0
        for motor, dof in zip(self._motors, self._dofs, strict=True):
            work += motor_work(
                data.actuator_force[motor], data.actuator_velocity[motor],
                data.ctrl[motor], data.qvel[dof], self._gain, self._limit_nm,
                self._timestep_s,
            )  # fmt: skip
        return work

    def _twist(self) -> tuple[float, float]:
        """Return v [m/s] and omega [rad/s] for now."""
        x, y = self._velocity.tolist()
        if self._turn_rate is not None:
            return x, self._turn_rate
        speed = math.sqrt(x * x + y * y)
        if speed < _STILL_MPS:
            return 0.0, 0.0
        error = self._error(math.atan2(y, x))
        omega = TURN_GAIN_HZ * error
        omega = min(max(omega, -TURN_RATE_RADPS), TURN_RATE_RADPS)
        ahead = math.cos(error) if abs(error) < AHEAD_RAD else 0.0
        return self._sense * speed * ahead, omega

    def _error(self, wanted_rad: float) -> float:
        """Return the error of the heading, or of the tail's, in [-pi, pi)."""
        nose = wanted_rad - float(self._data.qpos[self._yaw])
        tail = math.pi if self._sense < 0.0 else 0.0
        error = wrapped(nose + tail)
        now = self._data.time
        if abs(error) > SWAP_RAD and now - self._swapped_s >= SWAP_S:
            self._sense, self._swapped_s = -self._sense, now
            error = wrapped(error + math.pi)
        return error


@kernel
def motor_work(
    force: float,
    velocity: float,
    target: float,
    after: float,
    gain: float,
    limit: float,
    timestep_s: float,
) -> float:
    """Return the work of one motor in the physics step just taken [J].

    The torque is applied as in `drive.drive_work`: below its limit k (w* - w') of the
    end of the step, else the limit; the work is that times the mean speed.

    Args:
        force: Torque at the start of the step [N m].
        velocity: Speed w of the wheel at the start of the step [rad/s].
        target: Speed w* that the servo holds [rad/s].
        after: Speed w' at the end of the step [rad/s].
        gain: Gain k of the servo [N m s/rad].
        limit: Limit of the torque [N m].
        timestep_s: Physics step [s].
    """
    applied = force
    if abs(applied) < limit:
        applied = gain * (target - after)
    return applied * 0.5 * (velocity + after) * timestep_s
