"""Any-angle paths: pull a grid path tight against the exact footprints.

A grid path turns by multiples of 45 degrees and is up to 8 % too long. Pulling the
string keeps its homotopy class almost always, and every chord it puts in is checked
against the rounded footprints themselves, not against cells.

Shapes: m path points, n footprints, k core vertices.
"""

import math

import numpy as np

from beacon_mj.geometry import Array, Footprints, segment_core
from beacon_mj.jit import inlined, kernel
from beacon_mj.motion.buckets import SLACK_M, Buckets, boxes, bucketed
from beacon_mj.motion.grid import Cells
from beacon_mj.motion.sight import NOTHING, Solids, first_in_the_way, solids

_CELL_M = 1.0  #: Edge of the cells that footprints are listed by.


def shorten(
    path: Array, footprints: Footprints, clearance_m: float, passes: int = 3
) -> Array:
    """Return a shorter path with the same ends.

    Neighbouring points of `path` stay joined even where they come too close, so the
    result is never worse than what was given. Walls are convex: chords between points
    inside them need no test.

    Args:
        path: Polyline, shape (m, 2), m >= 2 [m].
        footprints: What to stay clear of.
        clearance_m: Distance that new chords keep from every footprint [m].
        passes: Times that the string is pulled, alternately from either end.

    Returns:
        Polyline, shape (p, 2), p >= 2 [m].
    """
    near = bucketed(*boxes(footprints, clearance_m), _frame(path))
    blocking = solids(footprints, clearance_m, touch_m=0.0)
    pulled = path
    for turn in range(passes):
        dense = pulled if turn == 0 else _densify(pulled, 0.04)
        keep = _pull(np.ascontiguousarray(dense[::-1]), near, blocking)
        pulled = dense[::-1][keep]
    return pulled if passes % 2 == 0 else np.ascontiguousarray(pulled[::-1])


def _frame(path: Array) -> tuple[Array, Array, float]:
    """Return the plane of the buckets about a path, which chords never leave."""
    return path.min(axis=0) - SLACK_M, path.max(axis=0) + SLACK_M, _CELL_M


def is_clear(path: Array, footprints: Footprints, clearance_m: float) -> bool:
    """Whether every segment of `path` keeps `clearance_m` from every footprint."""
    return bool(_all_clear(path, footprints.vertices, footprints.radius, clearance_m))


@kernel
def _circles(vertices: Array, radius: Array, centre: Array, reach: Array) -> None:
    """Fill in centres (n, 2) and radii (n,) of circles that hold footprints [m]."""
    for i in range(radius.shape[0]):
        for axis in range(2):
            low = high = vertices[i, 0, axis]
            for k in range(1, vertices.shape[1]):
                low = min(low, vertices[i, k, axis])
                high = max(high, vertices[i, k, axis])
            centre[i, axis] = 0.5 * (low + high)
            reach[i] += (high - low) * (high - low)
        reach[i] = 0.5 * math.sqrt(reach[i]) + radius[i]


@kernel
def _densify(path: Array, spacing_m: float) -> Array:
    """Insert points so that neighbours are at most `spacing_m` apart.

    By arc length, as `np.interp` does and to the same bits, in a tenth of its time.
    """
    m = path.shape[0]
    steps, arc, counts = np.zeros(m), np.zeros(m), np.zeros(m, np.int64)
    n = 1
    for i in range(m - 1):
        dx, dy = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
        steps[i] = math.sqrt(dx * dx + dy * dy)
        arc[i + 1] = arc[i] + steps[i]
        counts[i] = max(math.ceil(steps[i] / spacing_m), 1)
        n += counts[i]
    points = np.empty((n, 2))
    n = 0
    for i in range(m - 1):
        for within in range(counts[i]):
            at, j = arc[i] + steps[i] * within / counts[i], i
            while j + 1 < m and arc[j + 1] <= at:
                j += 1
            for axis in range(2):
                start = path[j, axis]
                if j + 1 < m and arc[j] != at:
                    slope = (path[j + 1, axis] - start) / (arc[j + 1] - arc[j])
                    start += slope * (at - arc[j])
                points[n, axis] = start
            n += 1
    points[n] = path[m - 1]
    return points


@kernel
def _clear(
    a: Array,
    b: Array,
    vertices: Array,
    radius: Array,
    centre: Array,
    reach: Array,
    need: float,
) -> bool:
    """Whether the segment ab keeps `need` [m] from every footprint."""
    ex, ey = b[0] - a[0], b[1] - a[1]
    length2 = max(ex * ex + ey * ey, 1e-18)
    for i in range(radius.shape[0]):
        dx, dy = centre[i, 0] - a[0], centre[i, 1] - a[1]
        t = min(1.0, max(0.0, (dx * ex + dy * ey) / length2))
        qx, qy = dx - t * ex, dy - t * ey
        near = reach[i] + need
        if qx * qx + qy * qy < near * near:
            gap = segment_core(a[0], a[1], b[0], b[1], vertices[i]) - radius[i]
            if gap < need:
                return False
    return True


@kernel
def _all_clear(path: Array, vertices: Array, radius: Array, need: float) -> bool:
    """Whether every segment of a path keeps clear; see `is_clear`."""
    n = radius.shape[0]
    centre, reach = np.empty((n, 2)), np.zeros(n)
    _circles(vertices, radius, centre, reach)
    for i in range(path.shape[0] - 1):
        if not _clear(path[i], path[i + 1], vertices, radius, centre, reach, need):
            return False
    return True


@kernel
def _pull(path: Array, near: Buckets, blocking: Solids) -> Cells:
    """Indices of the points to keep: from each, go to the farthest seen one.

    The farthest is bracketed by doubling and found by bisection: a string of convex
    obstacles hides points for good, so nearly every miss is only a smaller shortcut.
    """
    m = path.shape[0]
    keep = np.zeros(m, dtype=np.int64)
    count = 1
    at = 0
    while at < m - 1:
        low, step = at + 1, 1
        high = m
        while low < m - 1:
            trial = min(at + 2 * step, m - 1)
            if not _sees(path, at, trial, near, blocking):
                high = trial
                break
            low, step = trial, 2 * step
        while high - low > 1 and high < m:
            trial = (low + high) // 2
            if _sees(path, at, trial, near, blocking):
                low = trial
            else:
                high = trial
        at = low
        keep[count] = at
        count += 1
    return keep[:count]


@inlined
def _sees(path: Array, a: int, b: int, near: Buckets, blocking: Solids) -> bool:
    """Whether the chord between two points of a path keeps clear."""
    ax, ay, bx, by = path[a, 0], path[a, 1], path[b, 0], path[b, 1]
    return first_in_the_way(ax, ay, bx, by, near, blocking) == NOTHING
