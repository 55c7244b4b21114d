"""Shortest paths of a disc among footprints, on a visibility graph.

Nodes are the corners of polygons circumscribed about the dilated footprints, so that
every path found is truly free; with `FACETS` corners per full turn an arc is at most
tan(x)/x - 1 = 0.6 % longer than the true one (x = pi/FACETS).
"""

import heapq
import math

import numpy as np

from beacon_mj.geometry import (
    Array,
    Footprints,
    Mask,
    segment_core,
    signed_distance,
)
from beacon_mj.jit import kernel

FACETS = 24
_TOUCH = 1e-9  #: Rounding allowed when a path runs along a boundary [m].


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
    corners = _corners(footprints, clearance)
    west, south, east, north = bounds
    inside = (
        (corners[:, 0] >= west + clearance - _TOUCH)
        & (corners[:, 0] <= east - clearance + _TOUCH)
        & (corners[:, 1] >= south + clearance - _TOUCH)
        & (corners[:, 1] <= north - clearance + _TOUCH)
    )
    corners = corners[inside]
    if len(footprints) and len(corners):
        gaps = footprints.distances(corners).min(axis=1)
        corners = corners[gaps >= clearance - _TOUCH]
    nodes = np.vstack([start, goal, corners])
    return _a_star(nodes, footprints, clearance)


def _a_star(nodes: Array, footprints: Footprints, clearance: float) -> Array | None:
    """A* from node 0 to node 1, testing edges for visibility only when they help."""
    count = len(nodes)
    cost = np.full(count, np.inf)
    parent = np.full(count, -1)
    closed = np.zeros(count, dtype=np.bool_)
    to_goal = np.hypot(*(nodes - nodes[1]).T)
    centres, reach = _bounding_discs(footprints)
    cost[0] = 0.0
    queue = [(float(to_goal[0]), 0)]
    while queue:
        _, u = heapq.heappop(queue)
        if closed[u]:
            continue
        if u == 1:
            return _trace(nodes, parent)
        closed[u] = True
        improved = _relax(
            u, nodes, cost, parent, closed, clearance,
            footprints.vertices, footprints.radius, centres, reach,
        )  # fmt: skip
        for v in improved:
            heapq.heappush(queue, (float(cost[v] + to_goal[v]), int(v)))
    return None


def _trace(nodes: Array, parent: Array) -> Array:
    order = [1]
    while parent[order[-1]] >= 0:
        order.append(int(parent[order[-1]]))
    return np.asarray(nodes[order[::-1]])


def _bounding_discs(footprints: Footprints) -> tuple[Array, Array]:
    """Centres (n, 2) and radii (n,) of discs that contain the footprints [m]."""
    centres = footprints.vertices.mean(axis=1)
    spread = footprints.vertices - centres[:, None, :]
    return centres, np.hypot(spread[..., 0], spread[..., 1]).max(
        axis=1, initial=0.0
    ) + footprints.radius


@kernel
def _relax(
    u: int,
    nodes: Array,
    cost: Array,
    parent: Array,
    closed: Mask,
    clearance: float,
    vertices: Array,
    radius: Array,
    centres: Array,
    reach: Array,
) -> Array:
    """Improve the cost of every node seen from `u`; return those that improved."""
    improved = []
    ax, ay = nodes[u, 0], nodes[u, 1]
    for v in range(nodes.shape[0]):
        if closed[v]:
            continue
        bx, by = nodes[v, 0], nodes[v, 1]
        through = cost[u] + math.hypot(bx - ax, by - ay)
        if through >= cost[v]:
            continue
        if _visible(ax, ay, bx, by, clearance, vertices, radius, centres, reach):
            cost[v] = through
            parent[v] = u
            improved.append(v)
    return np.array(improved, dtype=np.int64)


@kernel
def _visible(
    ax: float,
    ay: float,
    bx: float,
    by: float,
    clearance: float,
    vertices: Array,
    radius: Array,
    centres: Array,
    reach: Array,
) -> bool:
    """Whether segment ab keeps `clearance` from every footprint."""
    ex, ey = bx - ax, by - ay
    length2 = ex * ex + ey * ey
    for i in range(vertices.shape[0]):
        cx, cy = centres[i, 0] - ax, centres[i, 1] - ay
        t = 0.0
        if length2 > 0.0:
            t = min(1.0, max(0.0, (cx * ex + cy * ey) / length2))
        if math.hypot(cx - t * ex, cy - t * ey) - reach[i] >= clearance:
            continue
        if segment_core(ax, ay, bx, by, vertices[i]) - radius[i] < clearance - 1e-9:
            return False
    return True


def _corners(footprints: Footprints, clearance: float) -> Array:
    """Corners of polygons circumscribed about the dilated footprints, (m, 2) [m]."""
    out = [np.zeros((0, 2))]
    for vertices, radius in zip(footprints.vertices, footprints.radius, strict=True):
        core = vertices[: 1 + int(np.any(vertices != vertices[-1], axis=1).sum())]
        out.append(_rounded_corners(core, float(radius) + clearance))
    return np.vstack(out)


def _rounded_corners(core: Array, radius: float) -> Array:
    """Circumscribe a polygon about one rounded core."""
    if len(core) == 1:
        angle = (np.arange(FACETS) + 0.5) * (2.0 * math.pi / FACETS)
        rim = radius / math.cos(math.pi / FACETS)
        return np.asarray(
            core[0] + rim * np.column_stack([np.cos(angle), np.sin(angle)])
        )
    edges = np.roll(core, -1, axis=0) - core
    normals = np.arctan2(-edges[:, 0], edges[:, 1])
    corners = []
    for point, before, after in zip(core, np.roll(normals, 1), normals, strict=True):
        turn = (after - before) % (2.0 * math.pi)
        count = max(1, math.ceil(turn * FACETS / (2.0 * math.pi)))
        step = turn / count
        angle = before + (np.arange(count) + 0.5) * step
        rim = radius / math.cos(0.5 * step)
        corners.append(point + rim * np.column_stack([np.cos(angle), np.sin(angle)]))
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
    if walls < clearance - _TOUCH:
        return False
    return all(
        signed_distance(point[0], point[1], v, r) >= clearance - _TOUCH
        for v, r in zip(footprints.vertices, footprints.radius, strict=True)
    )
