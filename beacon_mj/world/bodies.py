"""The obstacles of a world: where they are, what they cover, what moved or fell."""

import math
from collections.abc import Callable, Mapping, Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.numerics import norms
from beacon_mj.scene import Scene, shapes

_UPRIGHT = math.cos(math.radians(5.0))
_TOPPLED = math.cos(math.radians(45.0))
_NONE = np.zeros(0, np.int64)


class Bodies:
    """The obstacles as they stand now, refreshed after each control step.

    Attributes:
        qpos: The generalised positions of the world, which hold them.
        qpos_address: Where its free joint stands in qpos, -1 if fixed, shape (n,).
        poses: Positions and quaternions, shape (n, 7) [m].
        outlines: True footprints, in scene order; one that did not move keeps its
            object.
        footprints: The same, stacked.
    """

    def __init__(
        self,
        scene: Scene,
        qpos: Array,
        qpos_address: NDArray[np.int64],
        fixed_poses: Callable[[], Array],
    ) -> None:
        """Look at the obstacles of `scene`.

        Args:
            scene: The scene.
            qpos: See `Bodies`; it changes in place.
            qpos_address: See `Bodies`.
            fixed_poses: Returns the poses of the fixed obstacles, shape (f, 7) [m].
        """
        self.qpos = qpos
        self.qpos_address = qpos_address
        self._fixed_poses = fixed_poses
        self._ids = [o.id for o in scene.obstacles]
        self._shapes = [o.shape for o in scene.obstacles]
        self._local = [shapes.footprint(s) for s in self._shapes]
        self._stands = np.array(
            [not isinstance(s, shapes.Sphere | shapes.Capsule) for s in self._shapes],
            dtype=np.bool_,
        )
        self._free = np.flatnonzero(self.qpos_address >= 0)
        self._first = len(qpos) - 7 * len(self._free)  # The robot's come before.
        self._still = np.zeros(len(self._ids))
        self.reset()

    def reset(self) -> None:
        """Take the present state as the start of an episode."""
        self._fallen = np.zeros(len(self._ids), np.bool_)
        self._state: bytes | None = None
        self._moved = True
        self.poses = self._read()
        self.outlines: list[Footprint] = [
            self._outline(i) for i in range(len(self._ids))
        ]
        self.footprints = Footprints.stack(self.outlines)

    def place(self, poses: Mapping[str, Sequence[float]]) -> None:
        """Put obstacles at poses, shape (7,) each, by id."""
        for name, address in zip(self._ids, self.qpos_address, strict=True):
            if address >= 0 and name in poses:
                self.qpos[address : address + 7] = poses[name]

    def refresh(self) -> Array:
        """Read all poses; return how far each obstacle travelled, shape (n,) [m]."""
        state = self.qpos[self._first :].tobytes()
        self._moved = state != self._state
        if not self._moved:
            return self._still
        self._state = state
        before, self.poses = self.poses, self._read()
        changed = np.flatnonzero((self.poses != before).any(axis=1))
        for i in changed:
            self.outlines[i] = self._outline(int(i))
        if len(changed):
            self.footprints = Footprints.stack(self.outlines)
        return norms(self.poses[:, :2] - before[:, :2])

    def newly_toppled(self) -> NDArray[np.int64]:
        """Return the standing shapes that have fallen over since the last call."""
        if not self._moved:
            return _NONE
        x, y = self.poses[:, 4], self.poses[:, 5]
        uprightness = 1.0 - 2.0 * (x * x + y * y)
        fallen = (uprightness < _TOPPLED) & ~self._fallen
        self._fallen |= fallen
        return np.flatnonzero(fallen & self._stands)

    def _read(self) -> Array:
        """Return positions and quaternions of all obstacles, shape (n, 7)."""
        poses = np.empty((len(self._ids), 7))
        fixed = self.qpos_address < 0
        poses[fixed] = self._fixed_poses()
        free = self.qpos_address[self._free]
        poses[self._free] = self.qpos[free[:, None] + np.arange(7)]
        return poses

    def _outline(self, i: int) -> Footprint:
        """Return the true footprint of obstacle i at its present pose."""
        x, y, _, w, qx, qy, qz = self.poses[i]
        shape = self._shapes[i]
        if isinstance(shape, shapes.Sphere):
            return self._local[i].moved(x, y, 0.0)
        if 1.0 - 2.0 * (qx * qx + qy * qy) > _UPRIGHT:
            yaw = math.atan2(2.0 * (w * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
            return self._local[i].moved(x, y, yaw)
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, self.poses[i, 3:])
        turned = shapes.tilted_footprint(shape, rotation.reshape(3, 3))
        return turned.moved(x, y, 0.0)
