"""The push model of the paper, as printed (II.D, II.G).

An obstacle that the disc runs into translates along the contact normal if its breakaway
force F = mu rho V g is within the robot's; what it runs into translates along the same
line, each link compared alone, until a link is infeasible. The contact force is the
breakaway force, and displacing obstacles costs E = sum F_i d_i. Nothing turns.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.numerics import dot, norm
from beacon_mj.pushing.cascade import Cascade, cascade
from beacon_mj.pushing.sweeps import GRAZE_M, travel_gaps
from beacon_mj.scene import Scene
from beacon_mj.world.planar_contacts import Touches
from beacon_mj.world.planar_room import Room, deepest

_TOUCH_M = 1e-12  #: Depth of the disc below which nothing is pushed [m].
_ROUNDS = 8  #: Contacts that are resolved in one step; corners need two or three.


class Touch(NamedTuple):
    """Where the disc touches something.

    Attributes:
        first: The footprint that it touches.
        normal: Unit vector into it, shape (2,).
        point_m: The point, shape (2,) [m].
    """

    first: int
    normal: Array
    point_m: Array


class PaperPush:
    """Moves the disc, and what it pushes, by one step at a time."""

    def __init__(self, scene: Scene, room: Room) -> None:
        """Push the obstacles of a scene in their room."""
        self._room = room
        self._radius_m = scene.robot.radius_m
        self._force_max_n = scene.robot.force_max_n
        self._forces = [o.breakaway_force_n for o in scene.obstacles]
        self._walls = len(self._forces)  # Footprints from here on are walls.
        self._gaps = np.empty(len(room.cores))

    def advance(
        self, position: Array, travel: Array, command: Array
    ) -> tuple[Array, Touches, float]:
        """Move the disc by `travel`, as far as what it meets gives way.

        Args:
            position: Centre of the disc, shape (2,) [m].
            travel: Where it is driven, shape (2,) [m].
            command: Unit vector of the drive, shape (2,).

        Returns:
            The new centre, the contacts, and the work of the push [J].
        """
        start, touches, work = position, Touches(), 0.0
        position = start + travel
        for _ in range(_ROUNDS):
            i, gap, nx, ny = deepest(position, self._room.cores, self._room.radius)
            depth = self._radius_m - gap
            if depth <= _TOUCH_M:
                break
            normal = np.array([-nx, -ny])  # From the disc into what it touches.
            moved, chain = self._push(i, depth, normal)
            work += math.fsum(self._forces[k] * d for k, d in chain.moved)
            self._press(touches, chain, Touch(i, normal, position + gap * normal),
                        command)  # fmt: skip
            position = position - (depth - moved) * normal
        else:
            position = start  # Wedged.
        return position, touches, work

    def _push(self, first: int, depth: float, normal: Array) -> tuple[float, Cascade]:
        """Push obstacle `first` by at most `depth`; return how far, and the cascade."""
        if first >= self._walls:
            return 0.0, Cascade((), math.inf, first, 0.0)
        chain, moved = self._cascade(first, depth * normal), depth
        if not chain.feasible:
            moved, blocked = max(chain.room_m, 0.0), chain
            shorter = self._cascade(first, moved * normal) if moved > 0.0 else blocked
            chain = replace(blocked, moved=shorter.moved if moved > 0.0 else ())
        for k, distance in chain.moved:
            self._room.shift(k, distance * normal)
        return moved, chain

    def _cascade(self, first: int, travel: Array) -> Cascade:
        return cascade(
            first, travel, self._sweep, self._force, self._force_max_n, self._is_fixed,
            graze_m=0.0, each_alone=True,
        )  # fmt: skip

    def _sweep(self, i: int, travel: Array) -> list[tuple[int, float]]:
        """Return (index, gap [m]) of what obstacle i would sweep into."""
        distance = norm(travel)
        if distance <= 0.0:
            return []
        ux, uy = (travel / distance).tolist()
        room, gaps = self._room, self._gaps
        travel_gaps(i, ux, uy, room.cores, room.radius, gaps)
        hit = np.flatnonzero(gaps < distance - GRAZE_M)
        found = [(int(j), float(gaps[j])) for j in hit]
        return sorted(found, key=lambda each: each[1])

    def _force(self, i: int) -> float:
        return math.inf if i >= self._walls else self._forces[i]

    def _is_fixed(self, i: int) -> bool:
        return math.isinf(self._force(i))

    def _press(
        self, touches: Touches, chain: Cascade, touch: Touch, command: Array
    ) -> None:
        """Note the contact forces: breakaway forces, or what the drive holds against.

        Where the chain is blocked the robot presses with what its drive has along the
        normal, on the first link and through all on the one that does not give way.
        """
        held_n = self._force_max_n * max(dot(touch.normal, command), 0.0)
        robot = len(self._forces)
        touches.add(robot, self._entity(touch.first),
                    self._link_n(chain, touch.first, held_n) * touch.normal,
                    touch.point_m)  # fmt: skip
        for i, j in chain.links:
            point = 0.5 * (self._room.cores[i] + self._room.cores[j]).mean(axis=0)
            force = self._link_n(chain, j, held_n) * touch.normal
            touches.add(self._entity(i), self._entity(j), force, point)

    def _link_n(self, chain: Cascade, i: int, held_n: float) -> float:
        return self._force(i) if chain.feasible else held_n

    def _entity(self, i: int) -> int:
        """Return the entity of a footprint: an obstacle's number, or the wall's."""
        return i if i < self._walls else self._walls + 1
