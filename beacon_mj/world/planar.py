"""The planar world of the paper: a quasi-static disc among polygons (III.B).

The robot follows the command as its drive can. What it runs into gives way by a push
model, or stops it, and it slides along. Between two readings of the contact forces,
10 ms, it travels 5 mm at most. Nothing rolls, falls over or coasts.
"""

import math
from collections.abc import Mapping
from functools import cached_property

import mujoco
import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.numerics import dot, norm
from beacon_mj.pushing import PushModel
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.mjcf import TIMESTEP_S, scene_mjcf
from beacon_mj.world.base import BaseWorld
from beacon_mj.world.bodies import Bodies
from beacon_mj.world.limit_surface_push import LimitSurfacePush
from beacon_mj.world.outcome import Damage, StepOutcome
from beacon_mj.world.overnight import Left
from beacon_mj.world.paper_push import PaperPush
from beacon_mj.world.planar_contacts import Touches
from beacon_mj.world.planar_drive import driven, limited
from beacon_mj.world.planar_room import Room

MODELS: Mapping[PushModel, type[PaperPush | LimitSurfacePush]] = {
    "paper": PaperPush,
    "limit-surface": LimitSurfacePush,
}
#: Physics steps between two readings of the forces: there is no stiff bumper to follow.
_STEPS = 5
_HELD_M = 1e-9  #: Travel that is missing where something holds the disc [m].
_NEAR_M = 1e-6  #: Room beyond its way within which the disc is alone [m].


class PlanarWorld(BaseWorld):
    """One scene in the plane.

    Attributes:
        push: Name of the push model.
    """

    def __init__(
        self,
        scene: Scene,
        timestep_s: float = TIMESTEP_S,
        push: PushModel = "paper",
    ) -> None:
        """Set up the room of a scene.

        Args:
            scene: The scene.
            timestep_s: Physics step of the protocol [s]; forces are read, and pushes
                carried on, at five of them.
            push: The push model: `paper` or `limit-surface`.

        Raises:
            SceneError: If the scene is not valid.
        """
        period_s = scene.robot.control_period_s
        self._substeps = max(1, math.ceil(period_s / (_STEPS * timestep_s) - 1e-9))
        super().__init__(scene, period_s / self._substeps)
        self._mjcf_step_s = timestep_s
        self.push = push
        self._room = Room(scene)
        self._bodies = Bodies(
            scene, self._room.qpos, self._room.address, lambda: self._room.fixed_poses
        )
        self._model = MODELS[push](scene, self._room)
        self.reset()

    def reset(self, left: Left | None = None) -> None:
        """Return to the start of the episode; see `BaseWorld.reset`."""
        self._room.reset()
        self._forget(left)
        self._room.place()
        self._position = np.array(self.scene.start_m)
        self._velocity, self._bumper_n = np.zeros(2), np.zeros(2)
        self._full = False
        self._bodies.reset()
        self._write()

    def step(
        self, velocity_mps: Array, turn_rate_radps: float | None = None
    ) -> StepOutcome:
        """Apply a velocity command for one control period; see `BaseWorld.step`."""
        command = limited(velocity_mps, self.scene.robot.speed_mps)
        self._pairs.begin_step()
        damages: list[Damage] = []
        work = self._advance(command, damages)
        self._step += 1
        self._write()
        return self._outcome(self._pair_forces(), work, self._effort, damages)

    @property
    def position_m(self) -> Array:
        """Centre of the robot, shape (2,) [m]."""
        return self._position.copy()

    @property
    def velocity_mps(self) -> Array:
        """Velocity of the robot, shape (2,) [m/s]."""
        return self._velocity.copy()

    @property
    def bumper_force_n(self) -> Array:
        """Force on the bumper from outside, shape (2,) [N]."""
        return self._bumper_n.copy()

    @cached_property
    def mjcf(self) -> str:  # type: ignore[override]
        """The scene as MJCF, for logs and viewers."""
        return scene_mjcf(self.scene, self._mjcf_step_s)

    @cached_property
    def model(self) -> mujoco.MjModel:  # type: ignore[override]
        """The same, compiled."""
        return mujoco.MjModel.from_xml_string(self.mjcf)

    @cached_property
    def data(self) -> mujoco.MjData:  # type: ignore[override]
        """The present state in terms of `model`: positions, velocities and the time."""
        data = mujoco.MjData(self.model)
        self._copy_into(data)
        return data

    def _advance(self, command: Array, damages: list[Damage]) -> float:
        """Drive for one control period; return the work of the drives [J]."""
        speed = norm(command)
        direction = command / speed if speed > 0.0 else command
        works, k = [], 0
        while k < self._substeps:
            alone = min(self._substeps - k, self._steps_alone(command))
            if alone > 0:
                works.append(self._drive_alone(command, alone * self._timestep_s))
            else:
                works.append(self._substep(k, command, direction, damages))
            k += max(alone, 1)
        return math.fsum(works)

    def _drive_alone(self, command: Array, time_s: float) -> float:
        """Drive where there is nothing to touch; return the work [J]."""
        free = driven(self._velocity, command, self.scene.robot, time_s)
        self._position = self._position + free.travel_m
        self._velocity, self._full = free.velocity_mps, free.full
        self._bumper_n = np.zeros(2)
        return free.work_j

    def _substep(
        self, k: int, command: Array, direction: Array, damages: list[Damage]
    ) -> float:
        """Drive until the forces are read again; return the work [J]."""
        before, step_s = self._position, self._timestep_s
        free = driven(self._velocity, command, self.scene.robot, step_s)
        self._position, touches, work = self._model.advance(
            before, free.travel_m, direction
        )
        held = self._position - before - free.travel_m
        kinetic_j = free.work_j
        if norm(held) > _HELD_M:  # What is gained and lost again is no work.
            slower = (self._position - before) / step_s
            gained = dot(slower, slower) - dot(self._velocity, self._velocity)
            kinetic_j = max(0.0, 0.5 * self.scene.robot.mass_kg * gained)
            self._velocity = slower
        else:
            self._velocity = free.velocity_mps
        self._full = free.full
        time_s = self._step * self.scene.robot.control_period_s + (k + 1) * step_s
        self._read(touches, command, time_s, damages)
        return work + kinetic_j

    @property
    def _effort(self) -> float:
        """Drive force over its limit, in [0, 1]."""
        pressed = norm(self._bumper_n) / self.scene.robot.force_max_n
        return 1.0 if self._full else min(1.0, pressed)

    def _read(
        self, touches: Touches, command: Array, time_s: float, damages: list[Damage]
    ) -> None:
        """Read the contact forces, and what they did."""
        robot = len(self.broken)
        self._bumper_n = touches.on(robot)
        if not touches.pairs and not self._pairs.count[0] and not self._pushes.active:
            return
        largest = touches.read_into(self._pairs, robot + 2, self._timestep_s)
        self._weigh(largest, command, time_s, damages)

    def _steps_alone(self, command: Array) -> int:
        """Return for how many readings the disc can touch nothing, at least."""
        if self._pairs.count[0] or self._pushes.active:
            return 0
        x, y = self._position.tolist()
        west, south, east, north = self.scene.workspace_m
        gap = min(x - west, east - x, y - south, north - y)
        gap = min(gap, self.footprints.least_distance(self._position))
        reach_m = gap - self.scene.robot.radius_m - _NEAR_M
        fastest = max(norm(command), norm(self._velocity))
        return int(reach_m / max(fastest * self._timestep_s, 1e-9))

    def _write(self) -> None:
        """Write the robot into the generalised positions, as MuJoCo has them."""
        self._room.set_robot(self._position)
        if "data" in vars(self):
            self._copy_into(self.data)

    def _copy_into(self, data: mujoco.MjData) -> None:
        data.qpos[:] = self._room.qpos
        data.qvel[:2] = self._velocity
        data.time = self._step * self.scene.robot.control_period_s
