"""The room of a planar world: footprints that move, the walls, and the disc's contacts.

Poses stand in generalised positions as MuJoCo has them, so that push attempts, logs and
viewers read both worlds alike: the robot's two slides, the bumper's two, then position
and quaternion of each obstacle that is not fixed.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array, Footprint, Footprints, point_core
from beacon_mj.jit import kernel
from beacon_mj.scene import Scene, shapes
from beacon_mj.scene_gen.mjcf import WALL_M

ROBOT_QPOS = 4  #: Generalised positions of the robot, before those of the obstacles.


class Room:
    """Obstacles and walls of one scene in the plane.

    Attributes:
        qpos: Generalised positions; see the module.
        address: Where each obstacle's pose begins in `qpos`, -1 if fixed, shape (n,).
        local: Cores in the obstacles' own frames, padded, shape (n, k, 2) [m].
        cores: Cores of obstacles and walls now, shape (n + 4, k, 2) [m].
        radius: Rounding radii of both, shape (n + 4,) [m].
        fixed_poses: Poses of the fixed obstacles, shape (f, 7) [m].
    """

    def __init__(self, scene: Scene) -> None:
        """Set up the room of a scene."""
        self._scene = scene
        obstacles = scene.obstacles
        free = [i for i, o in enumerate(obstacles) if not o.fixed]
        self.address: NDArray[np.int64] = np.full(len(obstacles), -1, np.int64)
        self.address[free] = ROBOT_QPOS + 7 * np.arange(len(free))
        self.qpos = np.zeros(ROBOT_QPOS + 7 * len(free))
        own = [shapes.footprint(o.shape) for o in obstacles]
        padded = Footprints.stack([*own, *_walls(scene)])
        self.local = padded.vertices[: len(obstacles)].copy()
        self.cores, self.radius = padded.vertices, padded.radius
        poses = np.array([_pose(o.x_m, o.y_m, 0.5 * o.shape.height_m, o.yaw_rad)
                          for o in obstacles]).reshape(-1, 7)  # fmt: skip
        self._start = poses
        self.fixed_poses = poses[self.address < 0]
        self.reset()

    def reset(self) -> None:
        """Put everything where the scene has it."""
        self.qpos[:ROBOT_QPOS] = 0.0
        free = self.address >= 0
        self.qpos[ROBOT_QPOS:] = self._start[free].ravel()
        self.place()

    def place(self) -> None:
        """Bring all cores to the poses in `qpos`."""
        for i, address in enumerate(self.address.tolist()):
            pose = self._start[i] if address < 0 else self.qpos[address : address + 7]
            turned_core(self.local[i], pose, self.cores[i])

    def shift(self, i: int, offset: Array) -> None:
        """Move obstacle i by an offset, shape (2,) [m]."""
        address = self.address[i]
        self.qpos[address : address + 2] += offset
        self.cores[i] += offset

    def set_robot(self, position_m: Array) -> None:
        """Write the robot's centre, shape (2,) [m]; its bumper is rigid."""
        self.qpos[:2] = position_m - np.array(self._scene.start_m)


def _pose(x: float, y: float, z: float, yaw: float) -> tuple[float, ...]:
    return x, y, z, math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)


def _walls(scene: Scene) -> Sequence[Footprint]:
    """Return the walls around the workspace, as thick as those of the arena."""
    west, south, east, north = scene.workspace_m
    t = 2.0 * WALL_M[0]
    return [
        _rectangle(west - t, south - t, west, north + t),
        _rectangle(west - t, south - t, east + t, south),
        _rectangle(east, south - t, east + t, north + t),
        _rectangle(west - t, north, east + t, north + t),
    ]


def _rectangle(west: float, south: float, east: float, north: float) -> Footprint:
    corners = [(west, south), (east, south), (east, north), (west, north)]
    return Footprint(np.array(corners))


@kernel
def turned_core(local: Array, pose: Array, out: Array) -> None:
    """Fill `out` (k, 2) with a core at a pose (7,) that is turned about z only."""
    w, z = pose[3], pose[6]
    c, s = w * w - z * z, 2.0 * w * z
    for k in range(local.shape[0]):
        x, y = local[k, 0], local[k, 1]
        out[k, 0] = pose[0] + x * c - y * s
        out[k, 1] = pose[1] + x * s + y * c


@kernel
def surface(
    px: float, py: float, core: Array, radius: float
) -> tuple[float, float, float]:
    """Return the gap from a point to a footprint [m], and its outward normal there.

    The gap is negative inside. On the outline itself the normal is that of the edge.
    """
    distance, qx, qy, inside = point_core(px, py, core)
    if distance > 1e-7 and not inside:
        return distance - radius, (px - qx) / distance, (py - qy) / distance
    best, nx, ny = -math.inf, 1.0, 0.0
    k = core.shape[0]
    for e in range(k):
        f = e + 1 if e + 1 < k else 0
        ex, ey = core[f, 0] - core[e, 0], core[f, 1] - core[e, 1]
        length = math.sqrt(ex * ex + ey * ey)
        if length == 0.0:
            continue
        out = ((px - core[e, 0]) * ey - (py - core[e, 1]) * ex) / length
        if out > best:
            best, nx, ny = out, ey / length, -ex / length
    return (-distance if inside else distance) - radius, nx, ny


@kernel
def deepest(
    point: Array, cores: Array, radius: Array
) -> tuple[int, float, float, float]:
    """Return the nearest footprint to a point (2,), the gap [m], and its normal.

    The point stands for the disc; its radius is the caller's to take off.
    """
    nearest, best, nx, ny = -1, math.inf, 0.0, 0.0
    for i in range(cores.shape[0]):
        gap, x, y = surface(point[0], point[1], cores[i], radius[i])
        if gap < best:
            nearest, best, nx, ny = i, gap, x, y
    return nearest, best, nx, ny
