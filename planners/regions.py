"""The regions of free space on the known map, and the obstacles between them.

A region is a set of places that the robot's centre can reach without touching anything:
a part of the workspace, eroded by a clearance, less the footprints dilated by it.

Shapes: n obstacles, m regions.
"""

import heapq
import itertools
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from beacon_mj.geometry import Array, Footprints, Mask
from beacon_mj.numerics import norm

_QUAD_SEGMENTS = 8  #: Facets per quarter circle of dilated footprints.
_TOUCH_M = 1e-3  #: Gap up to which regions and dilated footprints touch [m].


@dataclass(frozen=True, slots=True, eq=False)
class Door:
    """An obstacle on the way to the goal, and the region behind it.

    Attributes:
        index: The obstacle.
        beyond: The first region on the way that is another one than the robot's.
    """

    index: int
    beyond: int


class Regions:
    """Free space of the known map, in its connected parts.

    Attributes:
        parts: The regions as polygons, shape (m,).
    """

    def __init__(
        self,
        footprints: Footprints,
        workspace_m: tuple[float, float, float, float],
        clearance_m: float,
    ) -> None:
        """Take the map apart.

        Args:
            footprints: All known obstacles.
            workspace_m: West, south, east, north limits [m].
            clearance_m: Distance that the robot's centre keeps from them [m].
        """
        west, south, east, north = workspace_m
        room = shapely.box(
            west + clearance_m, south + clearance_m,
            east - clearance_m, north - clearance_m,
        )  # fmt: skip
        cores = shapely.convex_hull(shapely.multipoints(footprints.vertices))
        self._grown = shapely.buffer(
            cores, footprints.radius + clearance_m, quad_segs=_QUAD_SEGMENTS
        )
        free = shapely.difference(room, shapely.union_all(self._grown))
        self.parts = shapely.get_parts(free)

    def of(self, point: Array, within_m: float) -> int | None:
        """Return the region nearest to a point (2,), None if all are further away."""
        if len(self.parts) == 0:
            return None
        away = shapely.distance(self.parts, shapely.points(point))
        nearest = int(np.argmin(away))
        return nearest if away[nearest] <= within_m else None

    @cached_property
    def touches(self) -> Mask:
        """Which obstacles bound which regions, shape (n, m)."""
        return np.asarray(
            shapely.dwithin(self._grown[:, None], self.parts[None, :], _TOUCH_M)
        )

    @cached_property
    def leans(self) -> Mask:
        """Which obstacles leave no way between each other, shape (n, n)."""
        return np.asarray(
            shapely.dwithin(self._grown[:, None], self._grown[None, :], _TOUCH_M)
        )

    def nearest_point(self, region: int, point: Array) -> Array:
        """Return the point of a region that is nearest to `point`, shape (2,) [m]."""
        line = shapely.shortest_line(self.parts[region], shapely.points(point))
        return np.asarray(shapely.get_coordinates(line)[0])


def nearest_door(
    regions: Regions,
    ends: tuple[int, int],
    points: tuple[Array, Array],
    centroids: Array,
    costs: Mapping[int, float],
    avoid: Set[int] = frozenset(),
) -> Door | None:
    """Return the first door on the cheapest way to the goal, obstacles passable.

    The relaxed-constraint heuristic of Stilman and Kuffner (2005): a shortest path on
    the graph whose nodes are obstacles, next to each other where they bound one region
    or leave no way between each other. Going from one centroid to the next costs the
    distance, going through an obstacle what `costs` says.

    Args:
        regions: Free space.
        ends: Regions of robot and goal, two different ones.
        points: Where robot and goal are, shape (2,) each [m].
        centroids: Of all obstacles, shape (n, 2) [m].
        costs: Cost of going through each obstacle that may be moved [m], by index.
        avoid: Obstacles that are no first door.
    """
    (start, goal), (here, there) = ends, points
    touches, ticket = regions.touches, itertools.count()
    queue: list[tuple[float, int, int, tuple[int, ...]]] = []
    for i in (i for i in costs if touches[i, start] and i not in avoid):
        way = norm(centroids[i] - here) + costs[i]
        heapq.heappush(queue, (way, next(ticket), i, (i,)))
    done: set[int] = set()
    while queue:
        way, _, i, path = heapq.heappop(queue)
        if i == -1:
            return Door(path[0], _beyond(regions, path, start, goal))
        if i in done:
            continue
        done.add(i)
        if touches[i, goal]:
            last = way + norm(there - centroids[i])
            heapq.heappush(queue, (last, next(ticket), -1, path))
        for j in _beside(regions, i, costs.keys() - done):
            onward = way + norm(centroids[j] - centroids[i]) + costs[j]
            heapq.heappush(queue, (onward, next(ticket), j, (*path, j)))
    return None


def _beside(regions: Regions, i: int, others: Set[int]) -> Iterator[int]:
    """Yield the obstacles that bound a region of obstacle i, or lean on it."""
    for j in sorted(others):
        if regions.leans[i, j] or (regions.touches[i] & regions.touches[j]).any():
            yield j


def _beyond(regions: Regions, path: tuple[int, ...], start: int, goal: int) -> int:
    """Return the first region but the robot's between the obstacles of a path."""
    for i, j in itertools.pairwise(path):
        shared = np.flatnonzero(regions.touches[i] & regions.touches[j])
        for region in shared[shared != start].tolist():
            return int(region)
    return goal
