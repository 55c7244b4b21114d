"""The push model of the planners: forces, energies, and chain reactions.

Cascades are those of `beacon_mj.pushing.cascade`, which the planar world obeys, on
*perceived* footprints, as upright prisms in python-fcl (paper II.D and II.G). Forces in
[N], lengths in [m].
"""

from collections.abc import Callable, Sequence
from functools import cache, cached_property

import fcl
import numpy as np

from beacon_mj.geometry import Array, Footprint, convex_hull
from beacon_mj.interface import SensedObstacle
from beacon_mj.numerics import norm, norms, unit_vectors
from beacon_mj.pushing.cascade import Cascade, cascade

#: Facets of a round footprint in the collision world.
_FACETS = 16
#: Overlap below which neighbours that merely touch do not count as hit [m].
_GRAZE_M = 0.01
#: Slack of bounding boxes, against rounding [m].
_BOX_SLACK_M = 1e-6


class PushWorld:
    """The perceived obstacles as prisms, for swept contacts of many candidates."""

    def __init__(self, obstacles: Sequence[SensedObstacle]) -> None:
        """Build the collision world of `obstacles`, in their order."""
        self.obstacles = tuple(obstacles)
        self._outlines = [outline(o.footprint) for o in self.obstacles]
        self._low = np.array([v.min(axis=0) for v in self._outlines])
        self._high = np.array([v.max(axis=0) for v in self._outlines])

    @cached_property
    def _solids(self) -> "_Solids":
        """The prisms; most questions are answered by their bounding boxes alone."""
        heights = [o.height_m for o in self.obstacles]
        return _Solids(
            [prism(v, h) for v, h in zip(self._outlines, heights, strict=True)]
        )

    def cascade(
        self,
        first: int,
        travel: Array,
        force: Callable[[int], float],
        force_max_n: float,
        fixed: Callable[[int], bool],
    ) -> Cascade:
        """Predict what moves when obstacle `first` is pushed by `travel` (II.G).

        Args:
            first: Index of the pushed obstacle.
            travel: Its displacement, shape (2,) [m].
            force: Breakaway force of an obstacle by index [N].
            force_max_n: What the robot can apply; the forces of all bodies ahead of
                it add up, other than printed, where each is compared alone.
            fixed: Whether an obstacle is known not to give way.

        Returns:
            The cascade; it stops at the first obstacle that cannot be moved.
        """
        return cascade(
            first, travel, self._hits, force, force_max_n, fixed, graze_m=_GRAZE_M
        )

    def _hits(self, i: int, travel: Array) -> list[tuple[int, float]]:
        """Return (index, gap [m]) of the obstacles that i would sweep into."""
        distance = norm(travel)
        if distance <= 0.0:
            return []
        start = _shrunk(self._outlines[i])
        swept = np.vstack([start, start + travel])
        if not self._others_in_box(i, swept):
            return []
        height, solids = self.obstacles[i].height_m, self._solids
        found = solids.touched(prism(convex_hull(swept), height), but=i)
        mover = fcl.CollisionObject(prism(start, height))
        return sorted(
            ((j, solids.time_of_contact(mover, j, travel) * distance) for j in found),
            key=lambda hit: hit[1],
        )

    def _others_in_box(self, i: int, points: Array) -> bool:
        """Whether any obstacle but i reaches into the bounding box of some points."""
        low, high = points.min(axis=0) - _BOX_SLACK_M, points.max(axis=0) + _BOX_SLACK_M
        inside = ((self._low <= high) & (self._high >= low)).all(axis=1)
        inside[i] = False
        return bool(inside.any())


class _Solids:
    """Prisms in a collision world."""

    def __init__(self, prisms: Sequence[fcl.Convex]) -> None:
        self._prisms = prisms
        self._objects = [fcl.CollisionObject(p) for p in prisms]
        self._index = {id(p): i for i, p in enumerate(prisms)}
        self._manager = fcl.DynamicAABBTreeCollisionManager()
        self._manager.registerObjects(self._objects)
        self._manager.setup()

    def touched(self, probe: fcl.Convex, but: int) -> set[int]:
        """Return the numbers of the prisms that `probe` overlaps, one excepted."""
        data = fcl.CollisionData(request=fcl.CollisionRequest(num_max_contacts=64))
        self._manager.collide(
            fcl.CollisionObject(probe), data, fcl.defaultCollisionCallback
        )
        found = (
            self._index.get(id(solid))
            for contact in data.result.contacts
            for solid in (contact.o1, contact.o2)
        )
        return {j for j in found if j is not None and j != but}

    def time_of_contact(
        self, mover: fcl.CollisionObject, j: int, travel: Array
    ) -> float:
        """Return the share of `travel` after which `mover` meets prism j."""
        end = fcl.Transform(np.array([travel[0], travel[1], 0.0]))
        other = self._objects[j]
        result = fcl.ContinuousCollisionResult()
        fcl.continuousCollide(
            mover,
            end,
            other,
            other.getTransform(),
            fcl.ContinuousCollisionRequest(),
            result,
        )
        return float(result.time_of_contact) if result.is_collide else 0.0


def outline(footprint: Footprint) -> Array:
    """Return a polygon around a footprint, round parts as facets, (k, 2) [m]."""
    if footprint.radius == 0.0:
        return footprint.vertices
    rim = footprint.radius * _unit_circle()
    points = footprint.vertices[:, None, :] + rim[None, :, :]
    return convex_hull(points.reshape(-1, 2))


@cache
def _unit_circle() -> Array:
    """Return points of the unit circle, shape (_FACETS, 2)."""
    return unit_vectors(np.arange(_FACETS) * (2.0 * np.pi / _FACETS))


def prism(vertices: Array, height_m: float) -> fcl.Convex:
    """Return the upright prism over a counter-clockwise convex polygon (k, 2)."""
    k = len(vertices)
    solid = np.zeros((2 * k, 3))
    solid[:k, :2] = vertices
    solid[k:, :2] = vertices
    solid[k:, 2] = height_m
    faces = [k, *range(k - 1, -1, -1), k, *range(k, 2 * k)]
    for i in range(k):
        j = (i + 1) % k
        faces += [4, i, j, k + j, k + i]
    return fcl.Convex(solid, k + 2, np.array(faces))


def _shrunk(vertices: Array) -> Array:
    """Shrink a polygon a little, so that neighbours it touches do not count as hit."""
    centre = vertices.mean(axis=0)
    spread = norms(vertices - centre).max()
    return np.asarray(centre + (vertices - centre) * (1.0 - _GRAZE_M / spread))


def impact_force_n(
    speed_mps: float, obstacle_kg: float, robot_kg: float, stiffness_npm: float
) -> float:
    """Return the peak force of a touch, v sqrt(k m_eff) [N].

    The bumper's spring stops the relative motion of two masses, with
    m_eff = m_robot m_obstacle / (m_robot + m_obstacle). What the drive adds behind it
    is not included.
    """
    effective = robot_kg * obstacle_kg / (robot_kg + obstacle_kg)
    return float(speed_mps * np.sqrt(stiffness_npm * effective))


def gentle_speed_mps(
    force_n: float, obstacle_kg: float, robot_kg: float, stiffness_npm: float
) -> float:
    """Return the touching speed at which `impact_force_n` is `force_n` [m/s]."""
    return force_n / impact_force_n(1.0, obstacle_kg, robot_kg, stiffness_npm)
