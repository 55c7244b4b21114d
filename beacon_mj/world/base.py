"""What every world of a scene shares: who touches, breaks and moves whom.

A world moves the robot and the obstacles by its own laws and fills one table of contact
forces. What follows from these forces is the same in all of them: push attempts,
damage, causes, and the outcome of a control step.
"""

import math
from abc import ABC, abstractmethod

import mujoco
import numpy as np
from msgspec import UNSET, UnsetType

from beacon_mj.errors import BeaconError
from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.scene import Robot, Scene
from beacon_mj.scene.checks import check_scene
from beacon_mj.scene_gen.robot_contract import fitted
from beacon_mj.scene_gen.robots import RobotFile, robot_in
from beacon_mj.world import contacts as ct
from beacon_mj.world.attribution import Attribution
from beacon_mj.world.bodies import Bodies
from beacon_mj.world.outcome import (
    ROBOT,
    WALL,
    Damage,
    Displacement,
    PairForce,
    StepOutcome,
)
from beacon_mj.world.overnight import Left
from beacon_mj.world.pushes import PushMonitor, update_attempts

NOTICEABLE_M = 1e-4  #: Travel within one control step that is reported [m].


class SimulationError(BeaconError):
    """The physics diverged or ran out of memory; the episode cannot go on."""


class BaseWorld(ABC):
    """One scene as it is now, stepped by velocity commands.

    Attributes:
        scene: The scene.
        robot_file: The robot's file.
        robot: Its numbers: the scene's, with mass, drive and bumper of the file.
        mjcf: The scene as MJCF; viewers draw every world from it.
        model: The same, compiled by MuJoCo.
        data: The present state in terms of `model`.
        broken: Which obstacles are broken, shape (n,).
    """

    scene: Scene
    mjcf: str
    model: mujoco.MjModel
    data: mujoco.MjData
    _bodies: Bodies

    def __init__(
        self,
        scene: Scene,
        timestep_s: float,
        robot: RobotFile | UnsetType = UNSET,
    ) -> None:
        """Check the scene, and begin with no contact.

        Args:
            scene: The scene.
            timestep_s: Time between two readings of the contact forces [s].
            robot: The robot in it, in place of the scene's own.

        Raises:
            SceneError: If the scene is not valid.
            TemplateError: If the robot does not keep the contract.
        """
        check_scene(scene)
        self.scene = scene
        self.robot_file = robot_in(scene, robot)
        self.robot: Robot = fitted(self.robot_file, scene.robot)
        self._timestep_s = timestep_s
        n = len(scene.obstacles)
        self._names = [*(o.id for o in scene.obstacles), ROBOT, WALL]
        self._break_force = np.array(
            [math.inf if o.break_force_n is None else o.break_force_n
             for o in scene.obstacles]
        )  # fmt: skip
        self._weakest = float(self._break_force.min(initial=math.inf))
        self._pairs = ct.PairTable.create(n, timestep_s)
        self._pushes = PushMonitor(self._names[:n], self.robot.force_max_n)
        self._attribution = Attribution()
        self.broken = np.zeros(n, np.bool_)
        self._step = 0

    @abstractmethod
    def reset(self, left: Left | None = None) -> None:
        """Return to the start of the episode, at time zero.

        Args:
            left: How the room was left the day before; None for the scene's own places.
        """

    @abstractmethod
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
            SimulationError: If the physics diverges.
        """

    @property
    @abstractmethod
    def position_m(self) -> Array:
        """Centre of the robot, shape (2,) [m]."""

    @property
    @abstractmethod
    def velocity_mps(self) -> Array:
        """Velocity of the robot's base, shape (2,) [m/s]."""

    @property
    @abstractmethod
    def bumper_force_n(self) -> Array:
        """Force on the bumper from outside, shape (2,) [N]."""

    @property
    def heading_rad(self) -> float | None:
        """Where the robot's nose points, in [-pi, pi); None if it does not turn."""
        return None

    @property
    def turn_rate_radps(self) -> float | None:
        """How fast the robot turns; None if it does not."""
        return None

    @property
    def footprints(self) -> Footprints:
        """True footprints of all obstacles now, in scene order."""
        return self._bodies.footprints

    @property
    def outlines(self) -> list[Footprint]:
        """The same, one by one; an obstacle that did not move keeps its object."""
        return self._bodies.outlines

    @property
    def poses(self) -> Array:
        """Position and quaternion of every obstacle, shape (n, 7) [m]."""
        return self._bodies.poses

    def _forget(self, left: Left | None) -> None:
        """Begin an episode with no contact, and broken what was broken before."""
        self._pairs.clear()
        self._pushes.reset()
        self._attribution = Attribution()
        self.broken[:] = False
        self._step = 0
        if left is not None:
            self._bodies.place(left.poses)
            self.broken[:] = [name in left.broken for name in self._names[:-2]]

    def _weigh(
        self, largest_n: float, command: Array, time_s: float, damages: list[Damage]
    ) -> None:
        """Draw the conclusions from the contact forces that were just read.

        Args:
            largest_n: The largest filtered force among them [N].
            command: Commanded velocity, shape (2,) [m/s].
            time_s: Simulation time [s].
            damages: What breaks is added to it.
        """
        pairs, pushes = self._pairs, self._pushes
        count = int(pairs.count[0])
        if largest_n > self._weakest:
            self._latch_damage(count, time_s, damages)
        if len(self.broken) and (count or pushes.active):
            update_attempts(
                pushes.table, pairs.ids, pairs.values, count, self._bodies.qpos,
                self._bodies.qpos_address, command, pushes.force_max_n, time_s,
                self._timestep_s,
            )  # fmt: skip

    def _latch_damage(self, count: int, time_s: float, damages: list[Damage]) -> None:
        """Latch obstacles that break now."""
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
            damages.append(Damage(self._names[i], other, force, time_s))
            self._pushes.broke(int(i), time_s, force)

    def _outcome(
        self,
        touching: tuple[PairForce, ...],
        work_j: float,
        effort: float,
        damages: list[Damage],
    ) -> StepOutcome:
        """Return what the control step did, from its contacts on."""
        self._attribution.update(touching)
        displacements = self._displacements()
        self._attribution.forget_resting({d.obstacle for d in displacements})
        return StepOutcome(
            step=self._step,
            time_s=self._step * self.scene.robot.control_period_s,
            position_m=self.position_m,
            velocity_mps=self.velocity_mps,
            bumper_force_n=self.bumper_force_n,
            drive_effort=effort,
            actuator_work_j=work_j,
            contacts=touching,
            attempts=self._pushes.collect(),
            displacements=displacements,
            damages=tuple(damages),
            toppled=tuple(self._names[i] for i in self._bodies.newly_toppled()),
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

    def _displacements(self) -> tuple[Displacement, ...]:
        """Return what moved in the control step, and by whom."""
        chains = self._attribution.chains
        return tuple(
            Displacement(self._names[i], travel, chains.get(self._names[i], ()))
            for i, travel in enumerate(self._bodies.refresh().tolist())
            if travel > NOTICEABLE_M
        )
