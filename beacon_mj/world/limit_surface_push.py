"""The push model `limit-surface`: quasi-static pushing, with rotation.

What the disc runs into moves by the motion of least dissipation on its own support
points; see `beacon_mj.pushing.least_dissipation`. A contact gives way if its force is
within what the drive has along its normal n: F_max along the command and a quarter of
it across, as the servos have,

    F <= min(F_max / |n . d|, F_max / 4 |n x d|),

d the direction of the command. Else the disc slides along what it touches.
"""

import math

import numpy as np
from numpy.typing import NDArray

from beacon_mj.constants import CLASSES, GRAVITY
from beacon_mj.geometry import Array
from beacon_mj.numerics import dot, norm
from beacon_mj.pushing.least_dissipation import ROBOT, least_dissipation
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.mjcf import ACROSS_SHARE
from beacon_mj.world.planar_contacts import Touches
from beacon_mj.world.planar_room import Room, turned_core
from beacon_mj.world.planar_touching import CONTACTS, find_contacts
from beacon_mj.world.supports import load_shares, support_points

PIECE_M = 0.001  #: Travel over which contacts are taken as they are [m].
_TRIES = 6  #: Contacts that may turn out not to give way in one piece.
_LEFT_M = 1e-5  #: Overlap at which what is in the way cannot be moved out of it [m].


class LimitSurfacePush:
    """Moves the disc, and what it pushes, by one step at a time."""

    def __init__(self, scene: Scene, room: Room) -> None:
        """Push the obstacles of a scene in their room."""
        self._room = room
        self._radius_m = scene.robot.radius_m
        self._force_max_n = scene.robot.force_max_n
        n = len(scene.obstacles)
        self._movable: NDArray[np.bool_] = np.zeros(n + 4, np.bool_)
        self._movable[:n] = room.address >= 0
        self._robot = n
        self._set_up_supports(scene)
        self._motion = np.zeros((n, 3))
        self._footprints = np.empty((CONTACTS, 2), np.int64)
        self._normals, self._points = np.empty((2, CONTACTS, 2))
        self._gaps = np.empty(CONTACTS)

    def advance(
        self, position: Array, travel: Array, command: Array
    ) -> tuple[Array, Touches, float]:
        """Move the disc by `travel`; see `PaperPush.advance`."""
        pieces = max(1, math.ceil(norm(travel) / PIECE_M - 1e-9))
        touches, work = Touches(), 0.0
        for _ in range(pieces):
            touches = Touches()
            moved, spent = self._piece(position, travel / pieces, command, touches)
            position, work = position + moved, work + spent
        return position, touches, work

    def _piece(
        self, position: Array, travel: Array, command: Array, touches: Touches
    ) -> tuple[Array, float]:
        """Move what is pushed; return how far the disc gets, and the work [J]."""
        room = self._room
        count = find_contacts(
            position, self._radius_m, norm(travel), room.cores, room.radius,
            self._movable, self._footprints, self._normals, self._points, self._gaps,
        )  # fmt: skip
        if count == 0:
            return travel, 0.0
        stands = self._stands(count)
        for _ in range(_TRIES):
            free = self._along(travel, stands)
            force, bodies, motion, left = self._solve(free, count, stands)
            stuck = self._stuck(force, command, count, stands, left)
            if stuck is None:
                break
            stands[stuck] = True
        else:
            return np.zeros(2), 0.0
        self._apply(bodies, motion)
        self._note(force, travel, command, count, stands, touches)
        return free, self._work_j(force, free, count)

    def _work_j(self, force: Array, travel: Array, count: int) -> float:
        """Return the work of the disc's contacts, from where their gaps are closed."""
        own = np.flatnonzero(self._footprints[:count, 0] == ROBOT)
        return math.fsum(
            force[k] * (dot(self._normals[k], travel) - self._gaps[k]) for k in own
        )

    def _stands(self, count: int) -> NDArray[np.bool_]:
        """Return which contacts of the disc are with what cannot move, (count,)."""
        first, second = self._footprints[:count].T
        return np.asarray((first == ROBOT) & ~self._movable[second])

    def _along(self, travel: Array, stands: NDArray[np.bool_]) -> Array:
        """Return the disc's travel along what does not give way, shape (2,) [m]."""
        held = np.flatnonzero(stands)
        moved = travel
        for _ in range(1 + len(held)):
            for k in held:
                excess = dot(self._normals[k], moved) - self._gaps[k]
                if excess > 0.0:
                    moved = moved - excess * self._normals[k]
        through = [dot(self._normals[k], moved) - self._gaps[k] for k in held]
        return np.zeros(2) if max(through, default=0.0) > _LEFT_M else moved

    def _solve(
        self, travel: Array, count: int, stands: NDArray[np.bool_]
    ) -> tuple[Array, NDArray[np.int64], Array, float]:
        """Return contact forces, bodies, their motions, and what still overlaps."""
        used = np.flatnonzero(~stands)
        pairs = self._footprints[:count][used]
        bodies = np.unique(pairs[(pairs >= 0) & self._movable[pairs]])
        forces = np.zeros(count)
        motion = self._motion[bodies]
        if len(bodies) == 0:
            return forces, bodies, motion, 0.0
        number = np.full(len(self._movable) + 1, -2)
        number[bodies], number[ROBOT] = np.arange(len(bodies)), ROBOT
        origins = self._origins(pairs)
        arms = (self._points[used][:, None] - origins).reshape(-1, 4)
        force = np.zeros(len(used))
        left = least_dissipation(
            self._turned(bodies), self._friction[bodies], number[pairs],
            self._normals[used], arms, self._gaps[used], travel, motion, force,
        )  # fmt: skip
        forces[used] = force
        return forces, bodies, motion, left

    def _stuck(
        self,
        force: Array,
        command: Array,
        count: int,
        stands: NDArray[np.bool_],
        left: float,
    ) -> int | None:
        """Return the disc's contact that gives way least, if one does not."""
        own = np.flatnonzero((self._footprints[:count, 0] == ROBOT) & ~stands)
        own = own[force[own] > 0.0]
        excess = [float(force[int(k)]) - self._capacity_n(int(k), command) for k in own]
        if not excess or (max(excess) <= 0.0 and left <= _LEFT_M):
            return None
        return int(own[int(np.argmax(excess))])

    def _capacity_n(self, k: int, command: Array) -> float:
        """Return what the drive has along the normal of a contact [N]."""
        nx, ny = self._normals[k].tolist()
        dx, dy = command.tolist()
        along, across = nx * dx + ny * dy, abs(nx * dy - ny * dx)
        if along <= 0.0:
            return 0.0
        limit = self._force_max_n / along
        sideways = ACROSS_SHARE * self._force_max_n / max(across, 1e-12)
        return float(min(limit, sideways))

    def _apply(self, bodies: NDArray[np.int64], motion: Array) -> None:
        """Move bodies; a turn by q is that of the quaternion (1, q / 2), normalised."""
        self._motion[bodies] = motion
        room = self._room
        for i, (dx, dy, turn) in zip(bodies.tolist(), motion.tolist(), strict=True):
            pose = room.qpos[room.address[i] : room.address[i] + 7]
            w, z = float(pose[3]), float(pose[6])
            half = 0.5 * turn
            w, z = w - z * half, z + w * half
            size = math.sqrt(w * w + z * z)
            pose[0] += dx
            pose[1] += dy
            pose[3], pose[6] = w / size, z / size
            turned_core(room.local[i], pose, room.cores[i])

    def _note(
        self,
        force: Array,
        travel: Array,
        command: Array,
        count: int,
        stands: NDArray[np.bool_],
        touches: Touches,
    ) -> None:
        """Note the contact forces; what stands is pressed with all of the drive."""
        for k in range(count):
            size = float(force[k])
            if stands[k] and dot(self._normals[k], travel) > self._gaps[k]:
                size = min(self._capacity_n(k, command), self._force_max_n)
            if size > 0.0:
                first, second = (self._entity(i) for i in self._footprints[k].tolist())
                touches.add(
                    first, second, size * self._normals[k], self._points[k].copy()
                )

    def _entity(self, i: int) -> int:
        if i == ROBOT:
            return self._robot
        return i if i < self._robot else self._robot + 1

    def _origins(self, pairs: NDArray[np.int64]) -> Array:
        """Return the origins of the bodies of some contacts, (c, 2, 2); 0 of others."""
        address = np.full(len(self._movable) + 1, -1)
        address[: self._robot] = self._room.address
        at = address[pairs]
        places = self._room.qpos[np.maximum(at, 0)[..., None] + np.arange(2)]
        return np.asarray(np.where(at[..., None] >= 0, places, 0.0))

    def _turned(self, bodies: NDArray[np.int64]) -> Array:
        """Return the support points of bodies from their origins now, (m, q, 2) [m]."""
        out = np.empty((len(bodies), *self._supports.shape[1:]))
        room = self._room
        for k, i in enumerate(bodies.tolist()):
            pose = room.qpos[room.address[i] : room.address[i] + 7].copy()
            pose[:2] = 0.0
            turned_core(self._supports[i], pose, out[k])
        return out

    def _set_up_supports(self, scene: Scene) -> None:
        """Set support points, and friction mu N on each, of all obstacles."""
        own = [
            support_points(o.shape, scene.surfaces[CLASSES.index(o.interaction)])
            for o in scene.obstacles
        ]
        width = max((len(points) for points in own), default=1)
        self._supports = np.zeros((len(own), width, 2))
        self._friction = np.zeros((len(own), width))
        for i, (o, points) in enumerate(zip(scene.obstacles, own, strict=True)):
            self._supports[i, : len(points)] = points
            slides_n = o.friction * o.mass_kg * GRAVITY
            self._friction[i, : len(points)] = slides_n * load_shares(points)
