"""From where pictures of a room are taken: from the south, above, with all of it in."""

from itertools import product
from math import cos, radians, sin, tan

import mujoco
import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.rendering.annotations import SCALE_OFFSET, scale_m

ASPECT = 15 / 13  #: Of a picture that a square workspace fills.
ELEVATION_DEG = -66.0
FIELD_DEG = 45.0  #: Vertical field of view, MuJoCo's default.
MARGIN = 0.97  #: Share of the picture, from its middle, that the room may take.
WALL_M, WALL_HEIGHT_M = 0.1, 0.2  #: Of the walls in arena.xml.


def camera_over(
    workspace_m: tuple[float, float, float, float], aspect: float = ASPECT
) -> mujoco.MjvCamera:
    """Return a camera that sees the whole room, its walls and its scale bar.

    It is as near as the picture allows: a corner that lies x to the side of the middle
    and z behind it is in sight from a distance d if x <= (d + z) tan(half field).

    Args:
        workspace_m: West, south, east and north end.
        aspect: Width of the picture over its height.
    """
    west, south, east, north = workspace_m
    middle = 0.5 * (west + east), 0.48 * south + 0.52 * north - 0.35, 0.0
    tilt = radians(ELEVATION_DEG)
    forward = np.array([0.0, cos(tilt), sin(tilt)])
    up = np.array([0.0, -sin(tilt), cos(tilt)])
    corners = _corners(workspace_m) - middle
    across = np.abs(corners[:, 0]) / aspect
    half = MARGIN * tan(radians(0.5 * FIELD_DEG))
    away = np.maximum(across, np.abs((corners * up).sum(axis=1))) / half
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = middle
    camera.distance = float((away - (corners * forward).sum(axis=1)).max())
    camera.azimuth, camera.elevation = 90.0, ELEVATION_DEG
    return camera


def _corners(workspace_m: tuple[float, float, float, float]) -> Array:
    """Return the corners of what has to be in the picture, shape (n, 3) [m]."""
    west, south, east, north = workspace_m
    bar = north + SCALE_OFFSET * scale_m(workspace_m)
    xs = west - WALL_M, east + WALL_M
    ys = south - WALL_M, north + WALL_M
    return np.array([*product(xs, ys, (0.0, WALL_HEIGHT_M)), (west, bar, 0.1)])
