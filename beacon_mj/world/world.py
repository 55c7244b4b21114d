"""The MuJoCo world of one scene: compile, settle, and step it.

Physics runs at 500 Hz, control at 10 Hz. While every obstacle sleeps, as many physics
steps run in one call as the robot needs at least to reach the nearest; otherwise the
contact forces are read after each step.
"""

import copy
import math
from collections.abc import Callable

import mujoco
import numpy as np
from msgspec import UNSET, UnsetType
from numpy.typing import NDArray

from beacon_mj.errors import SceneError
from beacon_mj.geometry import Array
from beacon_mj.numerics import norm, rotated
from beacon_mj.scene import Robot, Scene
from beacon_mj.scene_gen.mjcf import TIMESTEP_S, scene_mjcf
from beacon_mj.scene_gen.robot_contract import differential_drive
from beacon_mj.scene_gen.robots import RobotFile
from beacon_mj.world import contacts as ct
from beacon_mj.world.base import BaseWorld, SimulationError
from beacon_mj.world.bodies import Bodies
from beacon_mj.world.drive import Drive
from beacon_mj.world.outcome import ROBOT, Damage, PairForce, StepOutcome
from beacon_mj.world.overnight import Left
from beacon_mj.world.wheels import WheelDrive

#: Bumper forces beyond this multiple of what speed and drive can cause are no physics:
#: bodies have been pressed into each other.
IMPOSSIBLE = 2.0
SETTLE_S = 3.0  #: Longest time for obstacles to come to rest before the episode [s].
#: Slack in deciding how long nothing can be touched: the bumper's springs give [m].
_REACH_M = 0.003


class World(BaseWorld):
    """One scene in MuJoCo.

    Attributes:
        scene: The scene.
        robot_file: The robot's file.
        robot: Its numbers: the scene's, with mass, drive and bumper of the file.
        mjcf: The MJCF text that was compiled.
        model: The compiled model.
        data: Its state.
        broken: Which obstacles are broken, shape (n,).
    """

    def __init__(
        self,
        scene: Scene,
        timestep_s: float = TIMESTEP_S,
        watch: Callable[[], None] | None = None,
        robot: RobotFile | UnsetType = UNSET,
    ) -> None:
        """Compile the scene and let its obstacles settle.

        Args:
            scene: The scene.
            timestep_s: Physics step [s]; a different one is for convergence checks.
            watch: Called after each physics step of `step`, to look at `data`; the
                quiet shortcut is then never taken.
            robot: The robot in it, in place of the scene's own.

        Raises:
            SceneError: If the scene is not valid, MuJoCo cannot compile it, or the
                control period is no multiple of the physics step.
            TemplateError: If the robot does not keep the contract.
        """
        super().__init__(scene, timestep_s, robot)
        mujoco.set_mju_user_warning(_quiet)
        self.mjcf = scene_mjcf(scene, timestep_s, self.robot_file)
        self.model = _compiled(self.mjcf, scene.name)
        self.data = mujoco.MjData(self.model)
        self._watch = watch
        self._settled: mujoco.MjData | None = None
        self._substeps = _whole(scene.robot.control_period_s, timestep_s)
        self._impossible_n = IMPOSSIBLE * _impact_n(self.robot)
        self._origin = np.array(scene.start_m)
        self._drive = self._motors()
        self._deflection = int(self.model.joint("bumper_x").qposadr[0])
        self._index = np.array(
            [self.model.body(o.id).id for o in scene.obstacles], dtype=np.int64
        )
        self._fixed = self._index[[o.fixed for o in scene.obstacles]]
        self._bodies = Bodies(
            scene, self.data.qpos, self._addresses(), self._fixed_poses
        )
        self._entity = self._entities()
        self.reset()

    def reset(self, left: Left | None = None) -> None:
        """Return to the settled start of the episode, at time zero.

        The scene settles once: one whose model was altered by hand does not again.

        Args:
            left: How the room was left the day before; None for the scene's own places.
        """
        mujoco.mj_resetData(self.model, self.data)
        self._forget(left)
        self._drive.reset()
        self._settle(kept=left is None)
        self._bodies.reset()
        if left is not None:
            self._bodies.newly_toppled()  # What lies there fell the day before.

    def step(
        self, velocity_mps: Array, turn_rate_radps: float | None = None
    ) -> StepOutcome:
        """Apply a command for one control period.

        Args:
            velocity_mps: Commanded velocity, shape (2,) [m/s]; one above the robot's
                speed limit is scaled down. It is in the arena frame, or, with a turn
                rate, in the robot's: forwards, and 0.
            turn_rate_radps: Turn rate of a robot that turns; None to have it turn
                towards the velocity.

        Raises:
            SimulationError: If MuJoCo reports a warning or the state is not finite.
        """
        limited = self._drive.limited(velocity_mps)
        command = self._drive.command(limited, turn_rate_radps)
        self._pairs.begin_step()
        damages: list[Damage] = []
        work = self._advance(command, damages)
        self._step += 1
        self._check()
        touching = self._pair_forces()
        self._check_forces(touching)
        return self._outcome(touching, work, self._drive.effort, damages)

    @property
    def position_m(self) -> Array:
        """Centre of the robot, shape (2,) [m]."""
        return np.asarray(self._origin + self.data.qpos[:2])

    @property
    def velocity_mps(self) -> Array:
        """Velocity of the robot's base, shape (2,) [m/s]."""
        return np.array(self.data.qvel[:2])

    @property
    def heading_rad(self) -> float | None:
        """Where the robot's nose points, in [-pi, pi); None if it does not turn."""
        return self._drive.heading_rad

    @property
    def turn_rate_radps(self) -> float | None:
        """How fast the robot turns; None if it does not."""
        return self._drive.turn_rate_radps

    @property
    def bumper_force_n(self) -> Array:
        """Force on the bumper from outside, from its springs, shape (2,) [N]."""
        first = self._deflection
        deflection = np.array(self.data.qpos[first : first + 2])
        if (heading := self._drive.heading_rad) is not None:
            deflection = rotated(deflection, heading)
        return self.robot.bumper_stiffness_npm * deflection

    def _advance(self, command: Array, damages: list[Damage]) -> float:
        """Run the physics steps of one control period; return the drives' work [J]."""
        work, left = 0.0, self._substeps
        while left:
            alone = min(left, self._steps_alone(command))
            if alone > 1:
                work += self._work_alone(alone)
            else:
                self._drive.track()
                mujoco.mj_step(self.model, self.data)
                work += self._drive.step_work_j()
                self._read_contacts(command, damages)
            left -= max(alone, 1)
        return work

    def _steps_alone(self, command: Array) -> int:
        """Return for how many physics steps the robot can touch nothing, at least."""
        if (
            self._watch is not None
            or self._pairs.count[0]
            or self._pushes.active
            or self.data.ntree_awake > 1
        ):
            return 0
        x, y = position = self.position_m
        west, south, east, north = self.scene.workspace_m
        gap = min(x - west, east - x, y - south, north - y)
        if len(self.footprints):
            gap = min(gap, self.footprints.distance(position).min())
        fastest = max(norm(self.velocity_mps), norm(command))
        reach = gap - self.scene.robot.radius_m - _REACH_M
        return int(reach / max(fastest * self._timestep_s, 1e-9))

    def _work_alone(self, steps: int) -> float:
        """Take physics steps in which nothing is touched; return the drives' work [J].

        Wheels touch the floor, and their speeds follow the heading in every step.
        """
        drive, work = self._drive, 0.0
        if isinstance(drive, WheelDrive):
            for _ in range(steps):
                drive.track()
                mujoco.mj_step(self.model, self.data)
                work += drive.step_work_j()
            return work
        before = drive.stored_energy_j()
        self._step_alone(steps)
        return drive.stored_energy_j() - before

    def _step_alone(self, steps: int) -> None:
        """Take physics steps in which nothing is touched, without looking for it.

        Sleeping bodies stay asleep; the states are the same bits, in half the time.
        """
        options = self.model.opt
        flags = options.disableflags
        options.disableflags = flags | mujoco.mjtDisableBit.mjDSBL_CONTACT
        mujoco.mj_step(self.model, self.data, nstep=steps)
        options.disableflags = flags

    def _read_contacts(self, command: Array, damages: list[Damage]) -> None:
        """Read the forces of the physics step just taken, and what they did."""
        data, pairs = self.data, self._pairs
        if self._watch is not None:
            self._watch()
        contact = data.contact
        if len(contact) == 0 and pairs.count[0] == 0 and not self._pushes.active:
            return
        largest = ct.accumulate(
            contact.geom, contact.efc_address, contact.frame, contact.pos,
            data.efc_force, self._entity,
            pairs.ids, pairs.values, pairs.window, pairs.count, self._timestep_s,
        )  # fmt: skip
        self._weigh(largest, command, data.time, damages)

    def _settle(self, *, kept: bool) -> None:
        """Let obstacles come to rest, and begin at time zero.

        Args:
            kept: Whether the room is the scene's own; how that settles is kept.
        """
        if kept and self._settled is not None:
            mujoco.mj_copyData(self.data, self.model, self._settled)
            return
        self._come_to_rest()
        self.data.time = 0.0
        if kept:
            self._settled = copy.copy(self.data)

    def _come_to_rest(self) -> None:
        """Take physics steps until everything sleeps, or for `SETTLE_S`."""
        for _ in range(round(SETTLE_S / (50 * self._timestep_s))):
            mujoco.mj_step(self.model, self.data, nstep=50)
            if self.data.ntree_awake <= 1:
                break
        self._check()

    def _check(self) -> None:
        """Raise if MuJoCo warned or the state is not finite."""
        numbers = self.data.warning.number
        if numbers.any():
            kind = mujoco.mjtWarning(int(numbers.nonzero()[0][0])).name
            raise SimulationError(
                f"{self.scene.name}: MuJoCo reported {kind} at {self.data.time:.3f} s."
            )
        if not np.isfinite(self.data.qpos).all():
            raise SimulationError(
                f"{self.scene.name}: the state is not finite at {self.data.time:.3f} s."
            )

    def _check_forces(self, touching: tuple[PairForce, ...]) -> None:
        """Raise if the robot pressed harder than its speed and its drive can."""
        for pair in touching:
            if pair.counterpart == ROBOT and pair.peak_n > self._impossible_n:
                raise SimulationError(
                    f"{self.scene.name}: expected the bumper's force to stay below "
                    f"{self._impossible_n:.0f} N but it was {pair.peak_n:.0f} N on "
                    f"{pair.obstacle!r} at {self.data.time:.3f} s."
                )

    def _addresses(self) -> NDArray[np.int64]:
        """Return where each obstacle's free joint stands in qpos, -1 if fixed."""
        return np.array(
            [
                -1 if o.fixed else int(self.model.joint(o.id).qposadr[0])
                for o in self.scene.obstacles
            ],
            dtype=np.int64,
        )

    def _fixed_poses(self) -> Array:
        """Return positions and quaternions of the fixed obstacles, shape (f, 7)."""
        return np.hstack([self.data.xpos[self._fixed], self.data.xquat[self._fixed]])

    def _motors(self) -> Drive | WheelDrive:
        if self.robot_file.is_disc:
            return Drive(self.robot, self.model, self.data)
        known = differential_drive(self.robot_file)
        return WheelDrive(self.robot, known, self.model, self.data)

    def _entities(self) -> NDArray[np.int64]:
        """Return the entity of each geom."""
        model, n = self.model, len(self.scene.obstacles)
        body_entity = np.full(model.nbody, ct.FLOOR)
        body_entity[self._index] = np.arange(n)
        body_entity[model.body("bumper").id] = n
        entity = body_entity[model.geom_bodyid]
        for wall in ("wall_west", "wall_south", "wall_east", "wall_north"):
            entity[model.geom(wall).id] = n + 1
        return np.asarray(entity, dtype=np.int64)


def _compiled(mjcf: str, name: str) -> mujoco.MjModel:
    try:
        return mujoco.MjModel.from_xml_string(mjcf)
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise SceneError(f"{name}: MuJoCo cannot compile it: {reason}.") from error


def _impact_n(robot: Robot) -> float:
    """Return what the robot's speed and its drive can cause on the bumper [N]."""
    stiffness, mass = robot.bumper_stiffness_npm, robot.mass_kg
    return robot.speed_mps * math.sqrt(stiffness * mass) + robot.force_max_n


def _whole(period_s: float, timestep_s: float) -> int:
    """Return how many physics steps make up one control period."""
    count = round(period_s / timestep_s)
    if count < 1 or abs(count * timestep_s - period_s) > 1e-9:
        raise SceneError(
            f"Expected robot.control_period_s to be a multiple of the physics step of "
            f"{timestep_s:g} s but it was {period_s:g}."
        )
    return count


def _quiet(message: str) -> None:
    """Keep MuJoCo from writing its log file; warnings are counted and checked."""
