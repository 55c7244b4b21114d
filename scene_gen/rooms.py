"""The room of a family: its size, the robot in it, how it senses, start and goal."""

from typing import Any, Literal

import numpy as np
from msgspec import UNSET, UnsetType

from beacon_mj.errors import TemplateError, unknown
from beacon_mj.numerics import norm
from beacon_mj.scene import Robot, Sensing
from beacon_mj.scene_gen.family import Family
from beacon_mj.scene_gen.perception import ForceErrors
from beacon_mj.scene_gen.prototypes import DECIMALS
from beacon_mj.scene_gen.robots import DISC, robot_paths

Point = tuple[float, float]
Bounds = tuple[float, float, float, float]  #: West, south, east, north [m].

WORKSPACE_M: Bounds = (0.0, 0.0, 6.0, 6.0)  #: Of families that name none (paper II.A).
START_M = (0.35, 0.75)  #: Range of the start's distance from the west wall.
#: Largest offset of start and goal from the middle, per 6 m of the room's shorter side.
OFFSET_M = 1.2
_SENSING = {
    "sensing_radius": "radius_m",
    "pose_noise": "pose_noise_m",
    "missed_detection": "missed_detection",
    "robot_pose_noise": "robot_pose_noise_m",
    "force_noise": "force_noise",
    "material_error": "material_error",
    "score_concentration": "score_concentration",
}


def workspace_m(family: Family) -> Bounds:
    """Return the family's room, `workspace` wide and high, at the origin [m]."""
    if "workspace" not in family.numerics:
        return WORKSPACE_M
    width, height = family.range("workspace")
    return (0.0, 0.0, width, height)


def robot_of(family: Family) -> Robot:
    """Return the robot, with the family's own F_max if it has one."""
    if "force_max" not in family.numerics:
        return Robot()
    return Robot(force_max_n=family.value("force_max"))


def robot_model_of(family: Family) -> Literal["diff-drive"] | UnsetType:
    """Return the shipped robot that a family chooses; unset for the disc.

    Raises:
        TemplateError: If there is none of that name.
    """
    match family.texts.get("robot", DISC):
        case "disc":
            return UNSET
        case "diff-drive":
            return "diff-drive"
        case other:
            raise TemplateError(
                f"{family.source}: {unknown('robot', other, robot_paths())}"
            )


def sensing_of(
    family: Family, designed: ForceErrors | None = None
) -> Sensing | UnsetType:
    """Return how the family is sensed; unset if that is the protocol's to say.

    Args:
        family: The family.
        designed: How wrong the perceived forces are, if its layout makes them.
    """
    values: dict[str, Any] = {
        field: family.value(name)
        for name, field in _SENSING.items()
        if name in family.numerics
    }
    if "occlusion" in family.numerics:
        values["occlusion"] = family.value("occlusion") >= 0.5
    if designed is not None:
        values |= {"designed": True, **designed._asdict()}
    sensing = Sensing(**values)
    return UNSET if sensing == Sensing() else sensing


def start_and_goal(rng: np.random.Generator, room: Bounds) -> tuple[Point, Point]:
    """Draw a start near the west wall and a goal near the east wall.

    They are about as far apart as the room is wide: at most 1.4 m less and at least
    0.6 m less.
    """
    _, south, east, north = room
    middle = 0.5 * (south + north)
    offset = OFFSET_M * min(east, north) / 6.0
    near, far = START_M
    while True:
        start = rng.uniform((near, middle - offset), (far, middle + offset))
        goal = rng.uniform(
            (east - far, middle - offset), (east - near, middle + offset)
        )
        if east - 1.4 <= norm(goal - start) <= east - 0.6:
            return as_point(start), as_point(goal)


def as_point(values: np.ndarray) -> Point:
    """Return a place with as many decimals as scenes have."""
    return round(float(values[0]), DECIMALS), round(float(values[1]), DECIMALS)
