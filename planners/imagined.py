"""A world imagined from an observation, to try commands in before they are given.

This is the only module of the planners that imports MuJoCo. It is handed what every
planner gets and nothing else: outlines, densities and frictions as they are perceived.
So it is wrong wherever perception is, and where things are not seen at all.

The model is planar. The robot is a disc on two sliding joints whose servos have the
task's limits of speed and force; an obstacle is a prism or cylinder of its perceived
mass on two sliding joints and a hinge. Coulomb friction with the floor is dry friction
in these joints: along x and along y the perceived F_i = mu rho V g, about the hinge
F_i times two thirds of the radius of a disc of the same area.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Collection
from typing import NamedTuple

import mujoco
import numpy as np
from mujoco import rollout

from beacon_mj.geometry import Array
from beacon_mj.interface import Observation, SensedObstacle, Task

TIMESTEP_S = 0.02  #: Physics step of the imagined world [s].
_SERVO_S = 0.02  #: Time constant of the imagined drive [s].
_FRICTION = 0.1  #: Friction of the robot's own bumper.
_TALL_M = 0.5  #: Half height of what is no robot [m].
_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
_ROBOT_AT = 1  #: Where the robot's position begins in a state, after the time.


class Rollouts(NamedTuple):
    """What became of k sequences of h commands.

    Attributes:
        positions_m: Centre of the robot after each command, shape (k, h, 2) [m].
        forces_n: Mean normal force on the robot during each, shape (k, h) [N].
    """

    positions_m: Array
    forces_n: Array


class ImaginedWorld:
    """The robot among some perceived obstacles."""

    def __init__(
        self,
        observation: Observation,
        task: Task,
        near: Collection[int],
        fixed: Collection[str],
    ) -> None:
        """Compile the model.

        Args:
            observation: What is perceived.
            task: Robot and workspace.
            near: Indices of the obstacles that are in the model.
            fixed: Ids of those that are thought not to move at all.
        """
        obstacles = [observation.obstacles[i] for i in sorted(near)]
        self._model = mujoco.MjModel.from_xml_string(_mjcf(obstacles, task, fixed))
        self._data = mujoco.MjData(self._model)
        self._substeps = round(task.control_period_s / TIMESTEP_S)

    def roll_out(self, observation: Observation, commands_mps: Array) -> Rollouts:
        """Try sequences of commands from where the robot is, obstacles at rest.

        Args:
            observation: Where the robot is, and how fast; obstacles as in the model.
            commands_mps: Velocities, shape (k, h, 2) [m/s].
        """
        k, h, _ = commands_mps.shape
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:2] = observation.position_m
        self._data.qvel[:2] = observation.velocity_mps
        start = np.empty(mujoco.mj_stateSize(self._model, _STATE))
        mujoco.mj_getState(self._model, self._data, start, _STATE)
        controls = np.repeat(commands_mps, self._substeps, axis=1)
        states, sensed = rollout.rollout(self._model, self._data, start[None], controls)
        last = states[:, self._substeps - 1 :: self._substeps]
        forces = sensed.reshape(k, h, self._substeps)
        return Rollouts(
            np.ascontiguousarray(last[:, :, _ROBOT_AT : _ROBOT_AT + 2]),
            np.asarray(forces.sum(axis=2) / self._substeps),
        )


def _mjcf(obstacles: list[SensedObstacle], task: Task, fixed: Collection[str]) -> str:
    """Return the model as MJCF text."""
    root = ET.Element("mujoco")
    option = {"timestep": repr(TIMESTEP_S), "gravity": "0 0 0"}
    ET.SubElement(root, "option", option | {"integrator": "implicitfast"})
    assets = ET.SubElement(root, "asset")
    world = ET.SubElement(root, "worldbody")
    _add_walls(world, task)
    _add_robot(root, world, task)
    for number, obstacle in enumerate(obstacles):
        _add_obstacle(world, assets, f"o{number}", obstacle, obstacle.id in fixed)
    return ET.tostring(root, encoding="unicode")


def _add_walls(world: ET.Element, task: Task) -> None:
    west, south, east, north = task.workspace_m
    x, y = 0.5 * (west + east), 0.5 * (south + north)
    a, b, t = 0.5 * (east - west), 0.5 * (north - south), 0.1
    for place, size in (
        ((west - t, y), (t, b)), ((east + t, y), (t, b)),
        ((x, south - t), (a, t)), ((x, north + t), (a, t)),
    ):  # fmt: skip
        box = {"pos": _text(*place, 0.0), "size": _text(*size, _TALL_M)}
        ET.SubElement(world, "geom", box | {"type": "box"})


def _add_robot(root: ET.Element, world: ET.Element, task: Task) -> None:
    """Add a ball at half height, which meets upright faces as a disc does."""
    body = ET.SubElement(world, "body", name="robot")
    actuators, sensors = (ET.SubElement(root, tag) for tag in ("actuator", "sensor"))
    gain, limit = task.mass_kg / _SERVO_S, task.force_max_n
    for name, axis in (("x", "1 0 0"), ("y", "0 1 0")):
        ET.SubElement(body, "joint", name=name, type="slide", axis=axis)
        servo = {"joint": name, "kv": repr(gain), "forcerange": _text(-limit, limit)}
        ET.SubElement(actuators, "velocity", servo | {"forcelimited": "true"})
    ball = {"type": "sphere", "mass": repr(task.mass_kg), "priority": "1"}
    radius = {"size": repr(task.radius_m), "friction": _text(_FRICTION, 0.0, 0.0)}
    ET.SubElement(body, "geom", ball | radius)
    ET.SubElement(body, "site", name="bumper", size=repr(1.5 * task.radius_m))
    ET.SubElement(sensors, "touch", site="bumper")


def _add_obstacle(
    world: ET.Element, assets: ET.Element, name: str, o: SensedObstacle, fixed: bool
) -> None:
    """Add an obstacle where it is perceived, with dry friction for the floor's."""
    centre = o.centroid_m
    body = ET.SubElement(world, "body", name=name, pos=_text(*centre, 0.0))
    if not fixed:
        lever_m = 2.0 / 3.0 * math.sqrt(o.footprint.polygon().area / math.pi)
        force, torque = o.perceived_force_n, o.perceived_force_n * lever_m
        for kind, axis, friction in (
            ("slide", "1 0 0", force),
            ("slide", "0 1 0", force),
            ("hinge", "0 0 1", torque),
        ):
            joint = {"type": kind, "axis": axis, "frictionloss": repr(friction)}
            ET.SubElement(body, "joint", joint)
    mass = max(o.density_kgm3 * o.volume_m3, 1e-3)
    ET.SubElement(body, "geom", _shape(assets, name, o) | {"mass": repr(mass)})


def _shape(assets: ET.Element, name: str, o: SensedObstacle) -> dict[str, str]:
    """Return an outline as an upright geom about its centroid."""
    corners, radius = o.footprint.vertices - o.centroid_m, o.footprint.radius
    if len(corners) == 1:
        return {"type": "cylinder", "size": _text(radius, _TALL_M)}
    if radius > 0.0:
        outline = np.array(o.footprint.polygon().exterior.coords)[:-1]
        corners = outline - o.centroid_m
    prism = [(x, y, z) for x, y in corners.tolist() for z in (-_TALL_M, _TALL_M)]
    flat = [value for point in prism for value in point]
    ET.SubElement(assets, "mesh", name=name, vertex=_text(*flat))
    return {"type": "mesh", "mesh": name}


def _text(*values: float) -> str:
    """Return numbers as MJCF has them, every digit kept."""
    return " ".join(repr(float(value)) for value in values)
