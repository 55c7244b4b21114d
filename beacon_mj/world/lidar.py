"""A planar lidar: rays through the geometry that MuJoCo simulates.

The rays start at the robot's centre, at half of its height, and meet whatever stands
there: obstacles, whole or broken, and walls. The robot itself is invisible to them.
"""

import copy

import mujoco
import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import beam_angles
from beacon_mj.numerics import unit_vectors
from beacon_mj.world.base import BaseWorld

#: The group of geoms that rays pass through; of MuJoCo's six the last.
_INVISIBLE = 5


class Lidar:
    """Measures exact ranges in a world, and leaves that untouched.

    It has model and state of its own: whether somebody looks changes no bit of the
    physics.
    """

    def __init__(self, world: BaseWorld, beams: int, range_m: float) -> None:
        """Mount a lidar.

        Args:
            world: The world of the robot.
            beams: Number of beams, evenly all round, >= 1.
            range_m: Range from the robot's centre [m].
        """
        self._world = world
        self._model = copy.copy(world.model)
        self._model.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        self._data = mujoco.MjData(self._model)
        self._hide_robot()
        self.range_m = range_m
        self.height_m = scan_height_m(world.scene.robot.height_m)
        flat = unit_vectors(beam_angles(beams))
        self._directions = np.column_stack([flat, np.zeros(beams)]).ravel()
        self._groups = np.ones(mujoco.mjNGROUP, np.uint8)
        self._groups[_INVISIBLE] = 0
        self._geoms = np.empty(beams, np.int32)

    def ranges_m(self) -> Array:
        """Return the range of each beam now, shape (n,) [m]; infinite beyond range."""
        self._data.qpos[:] = self._world.data.qpos
        mujoco.mj_kinematics(self._model, self._data)
        eye = np.array([*self._world.position_m, self.height_m])
        ranges = np.empty(len(self._geoms))
        mujoco.mj_multiRay(
            self._model, self._data, eye, self._directions, self._groups, 1, -1,
            self._geoms, ranges, None, len(ranges), self.range_m,
        )  # fmt: skip
        ranges[(ranges < 0.0) | (ranges > self.range_m)] = np.inf
        return ranges

    def _hide_robot(self) -> None:
        """Put the geoms of all the robot's bodies into the group that is invisible."""
        model = self._model
        roots = model.body_rootid[model.geom_bodyid]
        robot = roots == model.body_rootid[model.body("bumper").id]
        model.geom_group[robot] = _INVISIBLE


def scan_height_m(robot_height_m: float) -> float:
    """Return how high above the floor the lidar is mounted: half way up [m]."""
    return 0.5 * robot_height_m
