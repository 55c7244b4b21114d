"""The drives: two servos turned into the direction of change, and their work."""

import mujoco
import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.jit import kernel
from beacon_mj.numerics import norm
from beacon_mj.scene import Robot
from beacon_mj.scene_gen.mjcf import ACROSS_SHARE, BUMPER_MASS_SHARE


class Drive:
    """Velocity servos along and across a direction, which limits their force.

    Attributes:
        axis: Unit vector along which the first servo acts, shape (2,).
        turns: Whether the robot has a heading: no.
    """

    turns = False
    heading_rad = None
    turn_rate_radps = None

    def __init__(
        self, robot: Robot, model: mujoco.MjModel, data: mujoco.MjData
    ) -> None:
        """Take over the actuators of `model`."""
        self._robot, self._model, self._data = robot, model, data
        self._gain = float(model.actuator_gainprm[0, 0])
        self._timestep_s = float(model.opt.timestep)
        self._ring_kg = BUMPER_MASS_SHARE * robot.mass_kg
        self.reset()

    def reset(self) -> None:
        """Act along the x axis first."""
        self.aim(np.array([1.0, 0.0]))

    def limited(self, velocity_mps: Array) -> Array:
        """Return a command scaled down to the robot's speed, shape (2,) [m/s]."""
        speed, limit = norm(velocity_mps), self._robot.speed_mps
        return velocity_mps * (limit / speed) if speed > limit else velocity_mps

    def command(
        self, velocity_mps: Array, turn_rate_radps: float | None = None
    ) -> Array:
        """Hold a velocity, shape (2,) [m/s], for the control period that begins.

        Returns the velocity; it has no use for a turn rate.
        """
        self.aim(self._direction(velocity_mps))
        x, y = self.axis
        self._data.ctrl[0] = velocity_mps[0] * x + velocity_mps[1] * y
        self._data.ctrl[1] = -velocity_mps[0] * y + velocity_mps[1] * x
        return velocity_mps

    def track(self) -> None:
        """Do nothing: the servos hold what they were told."""

    def aim(self, axis: Array) -> None:
        """Turn the servos along and across a unit vector, shape (2,)."""
        self.axis = axis
        self._model.actuator_gear[0, :2] = axis
        self._model.actuator_gear[1, :2] = -axis[1], axis[0]

    @property
    def effort(self) -> float:
        """Drive force over its limit, in [0, 1]."""
        force = norm(self._data.actuator_force)
        return min(1.0, force / self._robot.force_max_n)

    def step_work_j(self) -> float:
        """Return the work of both drives in the physics step just taken [J]."""
        data = self._data
        return float(
            drive_work(
                data.actuator_force, data.actuator_velocity, data.ctrl, data.qvel,
                self.axis, self._gain, self._robot.force_max_n, self._timestep_s,
            )
        )  # fmt: skip

    def stored_energy_j(self) -> float:
        """Return the kinetic energy of base and bumper, and that of its springs [J].

        While nothing is touched, its change is the work of the drives but for what
        the bumper's dampers take.
        """
        vx, vy, rx, ry = self._data.qvel[:4]
        sx, sy = self._data.qpos[2:4]
        base = (self._robot.mass_kg - self._ring_kg) * (vx * vx + vy * vy)
        ring = self._ring_kg * ((vx + rx) * (vx + rx) + (vy + ry) * (vy + ry))
        springs = self._robot.bumper_stiffness_npm * (sx * sx + sy * sy)
        return float(0.5 * (base + ring + springs))

    def _direction(self, command: Array) -> Array:
        """Return the unit vector along which the drive acts in this period.

        It is the direction in which the velocity must change, or, when there is
        little to change, the direction of the command, in which the robot pushes.
        """
        change = command - self._data.qvel[:2]
        size = norm(change)
        if size > 0.05:
            return np.asarray(change / size)
        speed = norm(command)
        return command / speed if speed > 1e-9 else self.axis


@kernel
def drive_work(
    force: Array,
    velocity: Array,
    target: Array,
    qvel: Array,
    axis: Array,
    gain: float,
    force_max_n: float,
    timestep_s: float,
) -> float:
    """Return the work of both drives in the physics step just taken [J].

    A servo's force k (v* - v) changes within the step. Below its limit, MuJoCo's
    implicit integrator applies the force at the end of the step, k (v* - v'); at its
    limit, the limit. The work is that force times the mean velocity.

    Args:
        force: Forces at the start of the step, along and across, shape (2,) [N].
        velocity: Velocities v at the start of the step, shape (2,) [m/s].
        target: Velocities v* that the servos hold, shape (2,) [m/s].
        qvel: Generalised velocities after the step; the first two are the base's.
        axis: Unit vector along which the first drive acts, shape (2,).
        gain: Gain k of the servos [N s/m].
        force_max_n: Limit of the drive along its direction [N].
        timestep_s: Physics step [s].
    """
    work = 0.0
    after_along = qvel[0] * axis[0] + qvel[1] * axis[1]
    after_across = qvel[1] * axis[0] - qvel[0] * axis[1]
    for i in range(2):
        after = after_along if i == 0 else after_across
        limit = force_max_n if i == 0 else ACROSS_SHARE * force_max_n
        applied = force[i]
        if abs(applied) < limit:
            applied = gain * (target[i] - after)
        work += applied * 0.5 * (velocity[i] + after) * timestep_s
    return work
