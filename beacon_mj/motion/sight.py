"""Which points see one another among footprints, by looking only at what is near.

Two points see each other if the segment between them keeps the clearance from every
footprint. `first_in_the_way` walks along a segment through the cells of a grid of
buckets. `seen_from` first finds how far a point can see at most: footprints grown by
the clearance cast shadows, cells in the dark are not looked into, and what lies in a
shadow is not tested. Both leave out only what cannot matter, so that answers are those
of a test of every segment against every footprint.

Directions are *diamond angles*: the place of a direction on the square |x| + |y| = 1,
from 0 (east) over 1 (north) to 4, which needs no trigonometry and keeps their order.

Shapes: n footprints, k core vertices, m points, b bins of directions.
"""

import math
from typing import NamedTuple

import numpy as np

from beacon_mj.geometry import (
    Array,
    Footprints,
    Mask,
    point_core,
    segment_core,
    signed_distance,
)
from beacon_mj.jit import inlined, kernel
from beacon_mj.motion.buckets import Buckets, Indices, cell_at
from beacon_mj.numerics import norms

TOUCH_M = 1e-9  #: Rounding allowed when a path runs along a boundary.
NOTHING, SOLID = -1, -2  #: What stands in the way, if it is no footprint's number.
_BINS = 256  #: Bins of directions.
_SHRUNK_M = 1e-6  #: Shadows are those of bodies smaller by this, against rounding.
_LONGER = 1.0 + 1e-9  #: Bounds of distances are larger by this, against rounding.


class Solids(NamedTuple):
    """Footprints that block the way.

    Attributes:
        vertices: Their cores, shape (n, k, 2) [m].
        radius: Their rounding radii, shape (n,) [m].
        removable: Which of them a question may leave out, shape (n,).
        centres: Points inside them, shape (n, 2) [m].
        reach: Radii of discs about these that contain them, shape (n,) [m].
        inner: Radii of discs about these that lie in them, shape (n,) [m].
        clearance: Distance to be kept from them [m].
        limit: Below which distance something is in the way: a little less, where
            rounding is allowed [m].
    """

    vertices: Array
    radius: Array
    removable: Mask
    centres: Array
    reach: Array
    inner: Array
    clearance: float
    limit: float


class Scratch(NamedTuple):
    """Memory that searches use again.

    Attributes:
        edges: Unit vectors along the edges of the bins, shape (b + 1, 2).
        horizon: How far one can see at most in each bin, shape (b,) [m].
        cells: Cells that may be in sight, shape (c,).
        reached: From which point each cell was reached last, shape (c,).
        asked: For which point each footprint was looked at last, shape (n,).
        found: Points in sight, shape (m,).
        by: What hides them, shape (m,).
    """

    edges: Array
    horizon: Array
    cells: Indices
    reached: Indices
    asked: Indices
    found: Indices
    by: Indices


def scratch_for(points: Array, near: Buckets, all_solids: Solids) -> Scratch:
    """Return memory for searches among these."""
    angles = np.arange(_BINS + 1) * (4.0 / _BINS)
    x = np.abs(angles - 2.0) - 1.0
    y = (1.0 - np.abs(x)) * np.where(angles <= 2.0, 1.0, -1.0)
    return Scratch(
        edges=np.column_stack([x, y]) / np.sqrt(x * x + y * y)[:, None],
        horizon=np.empty(_BINS),
        cells=np.empty(near.rows * near.cols, dtype=np.int64),
        reached=np.full(near.rows * near.cols, -1),
        asked=np.full(len(all_solids.radius), -1),
        found=np.empty(len(points), dtype=np.int64),
        by=np.empty(len(points), dtype=np.int64),
    )


def solids(
    footprints: Footprints,
    clearance: float,
    *,
    removable: Mask | None = None,
    touch_m: float = TOUCH_M,
) -> Solids:
    """Return footprints as the kernels take them.

    Args:
        footprints: What is to be kept clear of.
        clearance: Distance to be kept [m].
        removable: Which a question may leave out, shape (n,); none by default.
        touch_m: How much less than that is still enough [m].
    """
    if removable is None:
        removable = np.zeros(len(footprints), dtype=np.bool_)
    vertices = np.ascontiguousarray(footprints.vertices)
    centres = vertices.mean(axis=1)
    spread = norms(vertices - centres[:, None, :]).max(axis=1, initial=0.0)
    return Solids(
        vertices=vertices,
        radius=np.ascontiguousarray(footprints.radius),
        removable=removable,
        centres=centres,
        reach=spread + footprints.radius,
        inner=_inner(vertices, centres) + footprints.radius,
        clearance=float(clearance),
        limit=clearance - touch_m,
    )


def _inner(vertices: Array, centres: Array) -> Array:
    """Return how far centres (n, 2) are from the edges of their cores, (n,) [m]."""
    edges = np.concatenate([vertices[:, 1:], vertices[:, :1]], axis=1) - vertices
    to_centre, lengths = centres[:, None, :] - vertices, norms(edges)
    areas = edges[..., 0] * to_centre[..., 1] - edges[..., 1] * to_centre[..., 0]
    heights = np.full(lengths.shape, np.inf)
    np.divide(areas, lengths, out=heights, where=lengths > 0.0)
    least = heights.min(axis=1, initial=np.inf)
    return np.where(np.isfinite(least), np.maximum(least, 0.0), 0.0)


@kernel
def covers(points: Array, near: Buckets, all_solids: Solids) -> Indices:
    """Return what each point (m, 2) is too near to, shape (m,).

    The number of a footprint if it is one that may be left out; `SOLID` if it is
    another, or more than one; else `NOTHING`.
    """
    found = np.full(points.shape[0], NOTHING, dtype=np.int64)
    for j in range(points.shape[0]):
        x, y = points[j, 0], points[j, 1]
        row = cell_at(y, near.south, near.edge, near.rows)
        cell = row * near.cols + cell_at(x, near.west, near.edge, near.cols)
        for k in range(near.begin[cell], near.begin[cell + 1]):
            i = near.items[k]
            gap = signed_distance(x, y, all_solids.vertices[i], all_solids.radius[i])
            if gap < all_solids.limit:
                if not all_solids.removable[i] or found[j] != NOTHING:
                    found[j] = SOLID
                    break
                found[j] = i
    return found


@kernel
def first_in_the_way(
    ax: float, ay: float, bx: float, by: float, near: Buckets, all_solids: Solids
) -> int:
    """Return what keeps a and b from seeing each other; see `covers`."""
    ex, ey = bx - ax, by - ay
    c0 = cell_at(ax, near.west, near.edge, near.cols)
    c1 = cell_at(bx, near.west, near.edge, near.cols)
    step = 1 if c1 >= c0 else -1
    found = NOTHING
    for col in range(c0, c1 + step, step):
        # Where the segment enters the column, and where it leaves it.
        y0, y1 = ay, by
        if c0 != c1:
            left = near.west + col * near.edge
            t0, t1 = (left - ax) / ex, (left + near.edge - ax) / ex
            t0, t1 = min(t0, t1), max(t0, t1)
            if col != c0:
                y0 = ay + min(max(t0, 0.0), 1.0) * ey
            if col != c1:
                y1 = ay + min(max(t1, 0.0), 1.0) * ey
        r0 = cell_at(y0, near.south, near.edge, near.rows)
        r1 = cell_at(y1, near.south, near.edge, near.rows)
        up = 1 if r1 >= r0 else -1
        for row in range(r0, r1 + up, up):
            cell = row * near.cols + col
            for k in range(near.begin[cell], near.begin[cell + 1]):
                i = near.items[k]
                if i != found and _blocks(i, ax, ay, bx, by, all_solids):
                    if not all_solids.removable[i] or found != NOTHING:
                        return SOLID
                    found = i
    return found


@inlined
def _blocks(
    i: int, ax: float, ay: float, bx: float, by: float, all_solids: Solids
) -> bool:
    """Whether footprint i is too near to the segment ab; its discs tell mostly."""
    clearance, centres = all_solids.clearance, all_solids.centres
    ex, ey = bx - ax, by - ay
    length2 = ex * ex + ey * ey
    cx, cy = centres[i, 0] - ax, centres[i, 1] - ay
    t = 0.0
    if length2 > 0.0:
        t = min(1.0, max(0.0, (cx * ex + cy * ey) / length2))
    qx, qy = cx - t * ex, cy - t * ey
    away = math.sqrt(qx * qx + qy * qy)
    if away - all_solids.reach[i] >= clearance:
        return False
    if away - all_solids.inner[i] < all_solids.limit - _SHRUNK_M:
        return True
    gap = segment_core(ax, ay, bx, by, all_solids.vertices[i]) - all_solids.radius[i]
    return bool(gap < all_solids.limit)


@kernel
def seen_from(
    u: int,
    points: Array,
    of_points: Buckets,
    near: Buckets,
    all_solids: Solids,
    scratch: Scratch,
) -> tuple[Indices, Indices]:
    """Return the points that point u sees, and what must be left out for that.

    Args:
        u: Number of the point.
        points: All points, shape (m, 2) [m].
        of_points: Their buckets, on the same cells as `near`.
        near: Buckets of the footprints, grown by the clearance.
        all_solids: The footprints.
        scratch: Memory, see `scratch_for`.

    Returns:
        Numbers of points, and for each `NOTHING` or the number of the one footprint
        that hides it and may be left out.
    """
    x, y = points[u, 0], points[u, 1]
    horizon, found, by = scratch.horizon, scratch.found, scratch.by
    count = 0
    for k in range(_cast_shadows(u, x, y, near, all_solids, scratch)):
        cell = scratch.cells[k]
        if not _lit(x, y, cell, near, horizon):
            continue
        for item in range(of_points.begin[cell], of_points.begin[cell + 1]):
            v = of_points.items[item]
            dx, dy = points[v, 0] - x, points[v, 1] - y
            bound = horizon[_bin(dx, dy)]
            if v == u or dx * dx + dy * dy > bound * bound:
                continue
            what = first_in_the_way(x, y, points[v, 0], points[v, 1], near, all_solids)
            if what != SOLID:
                found[count], by[count] = v, what
                count += 1
    return found[:count].copy(), by[:count].copy()


@inlined
def _cast_shadows(
    u: int, x: float, y: float, near: Buckets, all_solids: Solids, scratch: Scratch
) -> int:
    """Find how far one sees from (x, y), spreading over the cells that may be in sight.

    Returns:
        How many these are, in `scratch.cells`; none from a point that is itself too
        near to something.
    """
    horizon, cells, reached = scratch.horizon, scratch.cells, scratch.reached
    _look_at_walls(x, y, near, scratch.edges, horizon)
    row = cell_at(y, near.south, near.edge, near.rows)
    cells[0] = row * near.cols + cell_at(x, near.west, near.edge, near.cols)
    reached[cells[0]] = u
    taken, count = 0, 1
    while taken < count:
        cell = cells[taken]
        taken += 1
        for k in range(near.begin[cell], near.begin[cell + 1]):
            i = near.items[k]
            if scratch.asked[i] != u and not all_solids.removable[i]:
                scratch.asked[i] = u
                if not _shade(x, y, i, all_solids, horizon):
                    return 0
        row, col = cell // near.cols, cell % near.cols
        for r in range(max(row - 1, 0), min(row + 2, near.rows)):
            for c in range(max(col - 1, 0), min(col + 2, near.cols)):
                beside = r * near.cols + c
                if reached[beside] != u:
                    reached[beside] = u
                    if _lit(x, y, beside, near, horizon):
                        cells[count] = beside
                        count += 1
    return count


@inlined
def _look_at_walls(
    x: float, y: float, near: Buckets, edges: Array, horizon: Array
) -> None:
    """See in each bin as far as the grid of buckets goes."""
    west, south = near.west - x, near.south - y
    east, north = west + near.cols * near.edge, south + near.rows * near.edge
    before = 0.0
    for k in range(_BINS + 1):
        ex, ey = edges[k, 0], edges[k, 1]
        along_x, along_y = np.inf, np.inf
        if ex != 0.0:
            along_x = (east if ex > 0.0 else west) / ex
        if ey != 0.0:
            along_y = (north if ey > 0.0 else south) / ey
        far = max(min(along_x, along_y), 0.0) * _LONGER
        if k > 0:
            horizon[k - 1] = max(before, far)
        before = far
    for dx in (west, east):
        for dy in (south, north):
            k = _bin(dx, dy)
            horizon[k] = max(horizon[k], math.sqrt(dx * dx + dy * dy) * _LONGER)


@inlined
def _shade(x: float, y: float, i: int, all_solids: Solids, horizon: Array) -> bool:
    """Lower the horizon where footprint i hides what is behind it.

    A segment from (x, y) that runs between the two tangents of the grown footprint, and
    is longer than both, meets it.

    Returns:
        False if (x, y) is itself too near to the footprint.
    """
    core, radius = all_solids.vertices[i], all_solids.radius[i]
    distance, _, _, inside = point_core(x, y, core)
    if inside or distance - radius < all_solids.limit:
        return False
    rim = max(radius + all_solids.clearance - _SHRUNK_M, 0.0)
    if distance - rim < 0.1 * _SHRUNK_M:
        return True  # So near that its tangents cannot be told from one another.
    lx = ly = rx = ry = longest_left = longest_right = 0.0
    for k in range(core.shape[0]):
        cx, cy = core[k, 0] - x, core[k, 1] - y
        d = math.sqrt(cx * cx + cy * cy)
        sine = rim / d
        cosine = math.sqrt(1.0 - sine * sine)
        cx, cy = cx / d, cy / d
        ax, ay = cosine * cx - sine * cy, sine * cx + cosine * cy
        bx, by = cosine * cx + sine * cy, cosine * cy - sine * cx
        if k == 0 or lx * ay - ly * ax > 0.0:
            lx, ly, longest_left = ax, ay, d * cosine
        if k == 0 or rx * by - ry * bx < 0.0:
            rx, ry, longest_right = bx, by, d * cosine
    far = max(longest_left, longest_right) * _LONGER
    right, left = _diamond_angle(rx, ry), _diamond_angle(lx, ly)
    if left < right:
        left += 4.0
    for k in range(int(right * _BINS / 4.0) + 1, int(left * _BINS / 4.0)):
        if horizon[k % _BINS] > far:
            horizon[k % _BINS] = far
    return True


@inlined
def _lit(x: float, y: float, cell: int, near: Buckets, horizon: Array) -> bool:
    """Whether any part of a cell may be in sight from (x, y)."""
    row, col = cell // near.cols, cell % near.cols
    dx = near.west + (col + 0.5) * near.edge - x
    dy = near.south + (row + 0.5) * near.edge - y
    half = 0.7072 * near.edge
    away = math.sqrt(dx * dx + dy * dy)
    if away < 2.0 * half:
        return True
    # A diamond angle grows at most as fast as the angle; asin(t) is at most pi t / 2.
    wide = int(1.5708 * half / away * _BINS / 4.0) + 2
    middle = _bin(dx, dy)
    for k in range(middle - wide, middle + wide + 1):
        if horizon[k % _BINS] >= away - half:
            return True
    return False


@inlined
def _bin(dx: float, dy: float) -> int:
    """Return the bin of a direction."""
    return min(int(_diamond_angle(dx, dy) * _BINS / 4.0), _BINS - 1)


@inlined
def _diamond_angle(dx: float, dy: float) -> float:
    """Return the diamond angle of a direction, in [0, 4)."""
    size = abs(dx) + abs(dy)
    if size == 0.0:
        return 0.0
    if dy >= 0.0:
        return 1.0 - dx / size
    return 3.0 + dx / size
