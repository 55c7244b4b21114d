"""Shortest paths of a disc among footprints, on a visibility graph.

Nodes are the corners of polygons circumscribed about the dilated footprints, so that
every path found is truly free; with `FACETS` corners per full turn an arc is at most
tan(x)/x - 1 = 0.6 % longer than the true one (x = pi/FACETS). Which nodes see one
another is found when a search comes by, and kept for the next search.
"""

import heapq
import math

import numpy as np

from beacon_mj.geometry import Array, Footprints, Mask, signed_distance
from beacon_mj.jit import kernel
from beacon_mj.motion.buckets import SLACK_M, Indices, boxes, bucketed
from beacon_mj.motion.sight import (
    NOTHING,
    SOLID,
    TOUCH_M,
    covers,
    scratch_for,
    seen_from,
    solids,
)
from beacon_mj.numerics import angles_of, norms, unit_vectors

FACETS = 24
#: Edge of a bucket's cell over the distance between footprints, were they on a lattice.
_CELL_SHARE = 0.7


def shortest_path(
    start: Array,
    goal: Array,
    footprints: Footprints,
    clearance: float,
    bounds: tuple[float, float, float, float],
) -> Array | None:
    """Return the shortest path that keeps `clearance` from footprints and bounds.

    Args:
        start: Where it begins, shape (2,) [m].
        goal: Where it ends, shape (2,) [m].
        footprints: What to keep clear of.
        clearance: Least distance of the path, the disc's radius [m].
        bounds: West, south, east, north of the workspace [m].

    Returns:
        Way-points from start to goal, shape (m, 2) [m], or None if none was found.
    """
    return VisibilityGraph(start, goal, footprints, clearance, bounds).shortest_path()


class VisibilityGraph:
    """The graph of one start and one goal among footprints, of which some may go.

    One graph answers for all footprints, and for all but any single one of those that
    may go: an edge that only one of these blocks is kept with its number.
    """

    def __init__(
        self,
        start: Array,
        goal: Array,
        footprints: Footprints,
        clearance: float,
        bounds: tuple[float, float, float, float],
        removable: Mask | None = None,
    ) -> None:
        """Place the nodes; no edge is looked for before it is asked for.

        Args:
            start: Where paths begin, shape (2,) [m].
            goal: Where they end, shape (2,) [m].
            footprints: What to keep clear of.
            clearance: Least distance of a path, the disc's radius [m].
            bounds: West, south, east, north of the workspace [m].
            removable: Which footprints a question may leave out, shape (n,); none by
                default.
        """
        self._solids = solids(footprints, clearance, removable=removable)
        corners, owner = _corners(footprints, clearance)
        inside = _inside(corners, clearance, bounds)
        nodes = np.vstack([start, goal, corners[inside]])
        owner = np.concatenate([[NOTHING, NOTHING], owner[inside]])
        low, high = boxes(footprints, clearance)
        frame = nodes.min(axis=0) - SLACK_M, nodes.max(axis=0) + SLACK_M
        cell_m = _CELL_SHARE * _spacing_m(bounds, len(footprints))
        self._near = bucketed(low, high, (*frame, cell_m))
        cover = covers(nodes, self._near, self._solids)
        cover[:2] = NOTHING  # Edges tell whether the ends are free.
        keep = cover != SOLID
        self._nodes, self._owner, self._cover = nodes[keep], owner[keep], cover[keep]
        self._of_nodes = bucketed(self._nodes, self._nodes, (*frame, cell_m))
        self._scratch = scratch_for(self._nodes, self._near, self._solids)
        self._seen: dict[int, tuple[Indices, Indices]] = {}
        self._to_goal = norms(self._nodes - self._nodes[1])

    def shortest_path(
        self, without: int = NOTHING, longest_m: float = math.inf
    ) -> Array | None:
        """Return the way-points (m, 2) [m] by A*, or None if there is no path.

        Args:
            without: Number of the one footprint that is left out, of those that may be.
            longest_m: Length above which a path is none [m].
        """
        count = len(self._nodes)
        cost = np.full(count, np.inf)
        parent = np.full(count, -1)
        closed = ~_exist(self._owner, self._cover, without)
        cost[0] = 0.0
        queue = [(float(self._to_goal[0]), 0)]
        while queue:
            bound_m, u = heapq.heappop(queue)
            if closed[u]:
                continue
            if bound_m > longest_m:
                return None
            if u == 1:
                return self._trace(parent)
            closed[u] = True
            improved = _relax(
                u, self._nodes, *self._edges(u), without, cost, parent, closed
            )
            for v in improved.tolist():
                heapq.heappush(queue, (float(cost[v] + self._to_goal[v]), v))
        return None

    def _edges(self, u: int) -> tuple[Indices, Indices]:
        """Return what node u sees, and what must be left out for that."""
        if u not in self._seen:
            self._seen[u] = seen_from(
                u, self._nodes, self._of_nodes, self._near, self._solids, self._scratch
            )
        return self._seen[u]

    def _trace(self, parent: Indices) -> Array:
        order = [1]
        while parent[order[-1]] >= 0:
            order.append(int(parent[order[-1]]))
        return np.asarray(self._nodes[order[::-1]])


def _spacing_m(bounds: tuple[float, float, float, float], count: int) -> float:
    """Return how far apart `count` things on a square lattice would be [m]."""
    west, south, east, north = bounds
    return math.sqrt((east - west) * (north - south) / max(count, 1))


def _inside(
    corners: Array, clearance: float, bounds: tuple[float, float, float, float]
) -> Mask:
    """Return which corners keep the clearance from the walls."""
    west, south, east, north = bounds
    return np.asarray(
        (corners[:, 0] >= west + clearance - TOUCH_M)
        & (corners[:, 0] <= east - clearance + TOUCH_M)
        & (corners[:, 1] >= south + clearance - TOUCH_M)
        & (corners[:, 1] <= north - clearance + TOUCH_M)
    )


def _exist(owner: Indices, cover: Indices, without: int) -> Mask:
    """Return which nodes there are without one footprint, or with all (`NOTHING`)."""
    free = cover == NOTHING
    if without == NOTHING:
        return np.asarray(free)
    return np.asarray((free | (cover == without)) & (owner != without))


@kernel
def _relax(
    u: int,
    nodes: Array,
    seen: Indices,
    by: Indices,
    without: int,
    cost: Array,
    parent: Indices,
    closed: Mask,
) -> Indices:
    """Improve the cost of every node seen from `u`; return those that improved."""
    improved = np.empty(seen.shape[0], dtype=np.int64)
    count = 0
    for k in range(seen.shape[0]):
        v = seen[k]
        if closed[v] or (by[k] != NOTHING and by[k] != without):
            continue
        ex, ey = nodes[v, 0] - nodes[u, 0], nodes[v, 1] - nodes[u, 1]
        through = cost[u] + math.sqrt(ex * ex + ey * ey)
        if through < cost[v]:
            cost[v] = through
            parent[v] = u
            improved[count] = v
            count += 1
    return improved[:count]


def _corners(footprints: Footprints, clearance: float) -> tuple[Array, Indices]:
    """Corners of polygons circumscribed about the dilated footprints.

    Returns:
        Where they are, shape (m, 2) [m]; and the footprint of each, shape (m,).
    """
    out, owner = [np.zeros((0, 2))], [np.zeros(0, dtype=np.int64)]
    for i, (vertices, radius) in enumerate(
        zip(footprints.vertices, footprints.radius, strict=True)
    ):
        core = vertices[: 1 + int(np.any(vertices != vertices[-1], axis=1).sum())]
        out.append(_rounded_corners(core, float(radius) + clearance))
        owner.append(np.full(len(out[-1]), i))
    return np.vstack(out), np.concatenate(owner)


def _rounded_corners(core: Array, radius: float) -> Array:
    """Circumscribe a polygon about one rounded core."""
    if len(core) == 1:
        angle = (np.arange(FACETS) + 0.5) * (2.0 * math.pi / FACETS)
        rim = radius / math.cos(math.pi / FACETS)
        return np.asarray(core[0] + rim * unit_vectors(angle))
    edges = np.roll(core, -1, axis=0) - core
    normals = angles_of(np.column_stack([edges[:, 1], -edges[:, 0]]))
    corners = []
    for point, before, after in zip(core, np.roll(normals, 1), normals, strict=True):
        turn = (after - before) % (2.0 * math.pi)
        count = max(1, math.ceil(turn * FACETS / (2.0 * math.pi)))
        step = turn / count
        angle = before + (np.arange(count) + 0.5) * step
        rim = radius / math.cos(0.5 * step)
        corners.append(point + rim * unit_vectors(angle))
    return np.vstack(corners)


def free_at(
    point: Array,
    footprints: Footprints,
    clearance: float,
    bounds: tuple[float, float, float, float],
) -> bool:
    """Whether a disc of radius `clearance` [m] stands free at `point` (2,) [m]."""
    west, south, east, north = bounds
    walls = min(point[0] - west, east - point[0], point[1] - south, north - point[1])
    if walls < clearance - TOUCH_M:
        return False
    return all(
        signed_distance(point[0], point[1], v, r) >= clearance - TOUCH_M
        for v, r in zip(footprints.vertices, footprints.radius, strict=True)
    )
