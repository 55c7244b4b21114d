"""The MuJoCo world of one scene: compile, settle, and step it.

Physics runs at 500 Hz, control at 10 Hz. While every obstacle sleeps and the robot is
too far from all of them to touch one within the control period, the physics steps of
that period run in one call; otherwise contact forces are read after each of them.
"""

import math
from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

from beacon_mj import shapes
from beacon_mj.errors import BeaconError, SceneError
from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.mjcf import TIMESTEP_S, scene_mjcf
from beacon_mj.world import contacts as ct
from beacon_mj.world.attribution import Attribution
from beacon_mj.world.drive import drive_work
from beacon_mj.world.outcome import (
    ROBOT,
    WALL,
    Damage,
    Displacement,
    PairForce,
    StepOutcome,
)
from beacon_mj.world.pushes import PushMonitor, update_attempts

#: Bumper forces beyond this multiple of what speed and drive can cause are no physics:
#: bodies have been pressed into each other.
IMPOSSIBLE = 2.0
SETTLE_S = 3.0  #: Longest time for obstacles to come to rest before the episode [s].
NOTICEABLE_M = 1e-4  #: Travel within one control step that is reported [m].
_UPRIGHT = math.cos(math.radians(5.0))
_TOPPLED = math.cos(math.radians(45.0))
_REACH_M = 0.005  #: Slack in deciding that nothing can be touched in one period.


class SimulationError(BeaconError):
    """The physics diverged or ran out of memory; the episode cannot go on."""


class World:
    """One scene in MuJoCo.

    Attributes:
        scene: The scene.
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
    ) -> None:
        """Compile the scene and let its obstacles settle.

        Args:
            scene: The scene.
            timestep_s: Physics step [s]; a different one is for convergence checks.
            watch: Called after each physics step of `step`, to look at `data`; the
                quiet shortcut is then never taken.

        Raises:
            SceneError: If the control period is no multiple of the physics step.
        """
        mujoco.set_mju_user_warning(_quiet)
        self.scene = scene
        self.mjcf = scene_mjcf(scene, timestep_s)
        self.model = mujoco.MjModel.from_xml_string(self.mjcf)
        self.data = mujoco.MjData(self.model)
        self._timestep_s = timestep_s
        self._watch = watch
        self._substeps = _whole(scene.robot.control_period_s, timestep_s)
        n = len(scene.obstacles)
        self._names = [*(o.id for o in scene.obstacles), ROBOT, WALL]
        self._entity = self._entities()
        robot = scene.robot
        impact = robot.speed_mps * math.sqrt(robot.bumper_stiffness_npm * robot.mass_kg)
        self._impossible_n = IMPOSSIBLE * (impact + robot.force_max_n)
        self._address = self._addresses()
        self._free = np.flatnonzero(self._address >= 0)
        self._break_force = np.array(
            [math.inf if o.break_force_n is None else o.break_force_n
             for o in scene.obstacles]
        )  # fmt: skip
        self._weakest = float(self._break_force.min(initial=math.inf))
        self._gain = float(self.model.actuator_gainprm[0, 0])
        self._origin = np.array(scene.start_m)
        self._local = [shapes.footprint(o.shape) for o in scene.obstacles]
        self._pairs = ct.PairTable.create(n, timestep_s)
        self._pushes = PushMonitor(n, scene.robot.force_max_n)
        self.broken = np.zeros(n, np.bool_)
        self.reset()

    def reset(self) -> None:
        """Return to the settled start of the episode, at time zero."""
        mujoco.mj_resetData(self.model, self.data)
        self._pairs.clear()
        self._pushes.reset()
        self._attribution = Attribution()
        self.broken[:] = False
        self._toppled = np.zeros(len(self.broken), np.bool_)
        self._step = 0
        self._aim(np.array([1.0, 0.0]))
        self._settle()
        self.data.time = 0.0
        self._poses = self._read_poses()
        self._up = self._uprightness()
        self._outlines: list[Footprint] = [
            self._outline(i) for i in range(len(self._names) - 2)
        ]
        self._footprints = Footprints.stack(self._outlines)

    def step(self, velocity_mps: Array) -> StepOutcome:
        """Apply a velocity command for one control period.

        Args:
            velocity_mps: Commanded velocity, shape (2,) [m/s]; one above the robot's
                speed limit is scaled down.

        Raises:
            SimulationError: If MuJoCo reports a warning or the state is not finite.
        """
        command = self._limited(velocity_mps)
        before = self._poses
        data = self.data
        kinetic = self._kinetic_energy()
        self._aim(self._direction(command))
        self._set_drive(command)
        self._pairs.begin_step()
        damages: list[Damage] = []
        if self._quiet(command):
            self._pairs.clear()
            mujoco.mj_step(self.model, data, nstep=self._substeps)
            work = self._kinetic_energy() - kinetic
            self._pushes.reset()
        else:
            work = self._watched(command, damages)
        self._step += 1
        self._check()
        touching = self._pair_forces()
        self._check_forces(touching)
        self._attribution.update(touching)
        self._poses = self._read_poses()
        displacements = self._displacements(before)
        self._attribution.forget_resting({d.obstacle for d in displacements})
        return StepOutcome(
            step=self._step,
            time_s=self._step * self.scene.robot.control_period_s,
            position_m=self.position_m,
            velocity_mps=self.velocity_mps,
            bumper_force_n=self.bumper_force_n,
            drive_effort=self._effort(),
            actuator_work_j=work,
            contacts=touching,
            attempts=self._pushes.collect(),
            displacements=displacements,
            damages=tuple(damages),
            toppled=self._newly_toppled(),
        )

    @property
    def position_m(self) -> Array:
        """Centre of the robot, shape (2,) [m]."""
        return np.asarray(self._origin + self.data.qpos[:2])

    @property
    def velocity_mps(self) -> Array:
        """Velocity of the robot's base, shape (2,) [m/s]."""
        return np.array(self.data.qvel[:2])

    @property
    def bumper_force_n(self) -> Array:
        """Force on the bumper from outside, from its springs, shape (2,) [N]."""
        return self.scene.robot.bumper_stiffness_npm * np.array(self.data.qpos[2:4])

    @property
    def footprints(self) -> Footprints:
        """True footprints of all obstacles now, in scene order."""
        return self._footprints

    @property
    def outlines(self) -> list[Footprint]:
        """The same, one by one; an obstacle that did not move keeps its object."""
        return self._outlines

    @property
    def poses(self) -> Array:
        """Position and quaternion of every obstacle, shape (n, 7) [m]."""
        return self._poses

    def _watched(self, command: Array, damages: list[Damage]) -> float:
        """Run one control period step by step; return the drives' work [J]."""
        model, data, pairs, pushes = self.model, self.data, self._pairs, self._pushes
        dt, n = self._timestep_s, len(self.broken)
        work = 0.0
        for _ in range(self._substeps):
            mujoco.mj_step(model, data)
            work += drive_work(
                data.actuator_force, data.actuator_velocity, data.ctrl, data.qvel,
                self._axis, self._gain, self.scene.robot.force_max_n, dt,
            )  # fmt: skip
            if self._watch is not None:
                self._watch()
            contact = data.contact
            if len(contact) == 0 and pairs.count[0] == 0 and not pushes.active:
                continue
            largest = ct.accumulate(
                contact.geom, contact.efc_address, contact.frame, contact.pos,
                data.efc_force, self._entity,
                pairs.ids, pairs.values, pairs.window, pairs.count, dt,
            )  # fmt: skip
            count = int(pairs.count[0])
            if largest > self._weakest:
                self._latch_damage(count, damages)
            if n and (count or pushes.active):
                update_attempts(
                    pushes.table, pairs.ids, pairs.values, count, data.qpos,
                    self._address, command, pushes.force_max_n, data.time, dt,
                )  # fmt: skip
        return work

    def _latch_damage(self, count: int, damages: list[Damage]) -> None:
        """Latch obstacles that break at this physics step."""
        pairs, before = self._pairs, self.broken.copy()
        if ct.find_damage(
            pairs.ids, pairs.values, count, self._break_force, self.broken
        ) < 0:  # fmt: skip
            return
        for i in np.flatnonzero(self.broken & ~before):
            rows = [k for k in range(count) if i in pairs.ids[k]]
            row = max(rows, key=lambda k: pairs.values[k, ct.FILTERED])
            a, b = pairs.ids[row]
            force = float(pairs.values[row, ct.FILTERED])
            other = self._names[b if a == i else a]
            damages.append(Damage(self._names[i], other, force, self.data.time))
            self._pushes.broke(int(i), self.data.time, force)

    def _quiet(self, command: Array) -> bool:
        """Whether nothing can touch anything within the control period."""
        if self.data.ntree_awake > 1 or self._watch is not None:
            return False
        robot = self.scene.robot
        x, y = self.position_m
        west, south, east, north = self.scene.workspace_m
        gap = min(x - west, east - x, y - south, north - y)
        if len(self._footprints):
            gap = min(gap, self._footprints.distance(self.position_m).min())
        fastest = max(float(np.hypot(*self.velocity_mps)), float(np.hypot(*command)))
        reach = fastest * robot.control_period_s + _REACH_M
        return bool(gap - robot.radius_m > reach)

    def _limited(self, velocity_mps: Array) -> Array:
        speed = float(np.hypot(*velocity_mps))
        limit = self.scene.robot.speed_mps
        return velocity_mps * (limit / speed) if speed > limit else velocity_mps

    def _direction(self, command: Array) -> Array:
        """Return the unit vector along which the drive acts in this period.

        It is the direction in which the velocity must change, or, when there is
        little to change, the direction of the command, in which the robot pushes.
        """
        change = command - self.velocity_mps
        size = float(np.hypot(*change))
        if size > 0.05:
            return change / size
        speed = float(np.hypot(*command))
        return command / speed if speed > 1e-9 else self._axis

    def _aim(self, axis: Array) -> None:
        self._axis = axis
        self.model.actuator_gear[0, :2] = axis
        self.model.actuator_gear[1, :2] = -axis[1], axis[0]

    def _set_drive(self, command: Array) -> None:
        x, y = self._axis
        self.data.ctrl[0] = command[0] * x + command[1] * y
        self.data.ctrl[1] = -command[0] * y + command[1] * x

    def _effort(self) -> float:
        force = float(np.hypot(*self.data.actuator_force))
        return min(1.0, force / self.scene.robot.force_max_n)

    def _kinetic_energy(self) -> float:
        return (
            0.5
            * self.scene.robot.mass_kg
            * float(self.velocity_mps @ self.velocity_mps)
        )

    def _settle(self) -> None:
        """Let obstacles come to rest."""
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

    def _pair_forces(self) -> tuple[PairForce, ...]:
        """Return the obstacle contacts of the control step."""
        pairs = self._pairs
        out = []
        for k in range(int(pairs.count[0])):
            v = pairs.values[k]
            if v[ct.PEAK] > 0.0:
                a, b = pairs.ids[k]
                out.append(
                    PairForce(
                        self._names[a], self._names[b], v[:3].copy(), v[3:6].copy(),
                        float(v[ct.FILTERED]), float(v[ct.PEAK]),
                        float(v[ct.FILTERED_PEAK]), float(v[ct.IMPULSE]),
                    )
                )  # fmt: skip
        return tuple(out)

    def _read_poses(self) -> Array:
        """Return positions and quaternions of all obstacles, shape (n, 7)."""
        n = len(self._address)
        poses = np.empty((n, 7))
        fixed = self._address < 0
        poses[fixed, :3] = self.data.xpos[self._bodies[fixed]]
        poses[fixed, 3:] = self.data.xquat[self._bodies[fixed]]
        free = self._address[self._free]
        poses[self._free] = self.data.qpos[free[:, None] + np.arange(7)]
        return poses

    def _displacements(self, before: Array) -> tuple[Displacement, ...]:
        """Return what moved in the step, and refresh its footprints."""
        changed = np.flatnonzero((self._poses != before).any(axis=1))
        if len(changed) == 0:
            return ()
        for i in changed:
            self._outlines[i] = self._outline(int(i))
        self._footprints = Footprints.stack(self._outlines)
        travel = np.hypot(*(self._poses[:, :2] - before[:, :2]).T)
        chains = self._attribution.chains
        return tuple(
            Displacement(
                self._names[i], float(travel[i]), chains.get(self._names[i], ())
            )
            for i in changed
            if travel[i] > NOTICEABLE_M
        )

    def _outline(self, i: int) -> Footprint:
        """Return the true footprint of obstacle i at its present pose."""
        x, y, _, w, qx, qy, qz = self._poses[i]
        shape = self.scene.obstacles[i].shape
        if isinstance(shape, shapes.Sphere):
            return self._local[i].moved(x, y, 0.0)
        if 1.0 - 2.0 * (qx * qx + qy * qy) > _UPRIGHT:
            yaw = math.atan2(2.0 * (w * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
            return self._local[i].moved(x, y, yaw)
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, self._poses[i, 3:])
        turned = shapes.tilted_footprint(shape, rotation.reshape(3, 3))
        return turned.moved(x, y, 0.0)

    def _uprightness(self) -> Array:
        """Return the cosine of each obstacle's tilt, shape (n,)."""
        return 1.0 - 2.0 * (self._poses[:, 4] ** 2 + self._poses[:, 5] ** 2)

    def _newly_toppled(self) -> tuple[str, ...]:
        """Return standing shapes that have fallen over since the last step."""
        fallen = (self._uprightness() < _TOPPLED) & ~self._toppled
        out = []
        for i in np.flatnonzero(fallen):
            self._toppled[i] = True
            if not isinstance(
                self.scene.obstacles[i].shape, shapes.Sphere | shapes.Capsule
            ):
                out.append(self._names[i])
        return tuple(out)

    def _entities(self) -> NDArray[np.int64]:
        """Return the entity of each geom."""
        model, n = self.model, len(self.scene.obstacles)
        body_entity = np.full(model.nbody, ct.FLOOR)
        self._bodies = np.array(
            [model.body(o.id).id for o in self.scene.obstacles], dtype=np.int64
        )
        body_entity[self._bodies] = np.arange(n)
        body_entity[model.body("bumper").id] = n
        entity = body_entity[model.geom_bodyid]
        for wall in ("wall_west", "wall_south", "wall_east", "wall_north"):
            entity[model.geom(wall).id] = n + 1
        return np.asarray(entity, dtype=np.int64)

    def _addresses(self) -> NDArray[np.int64]:
        """Return where each obstacle's free joint stands in qpos, -1 if fixed."""
        return np.array(
            [
                -1 if o.fixed else int(self.model.joint(o.id).qposadr[0])
                for o in self.scene.obstacles
            ],
            dtype=np.int64,
        )


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
