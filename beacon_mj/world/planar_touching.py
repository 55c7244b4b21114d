"""Which footprints may touch which within a small travel, found from the disc on.

Face on face there are two contacts, at the ends of where they overlap.
"""

import math

import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array
from beacon_mj.jit import kernel
from beacon_mj.pushing.least_dissipation import ROBOT
from beacon_mj.world.planar_room import surface

CONTACTS = 256  #: Most contacts of one moment.
_APART_M = 1e-6  #: Overlap of two faces below which one contact is enough [m].


@kernel
def find_contacts(
    position: Array,
    disc_m: float,
    reach_m: float,
    cores: Array,
    radius: Array,
    movable: NDArray[np.bool_],
    footprints: NDArray[np.int64],
    normals: Array,
    points: Array,
    gaps: Array,
) -> int:
    """Fill the arrays with the contacts of the disc, and of all that it reaches.

    Args:
        position: Centre of the disc, shape (2,) [m].
        disc_m: Its radius [m].
        reach_m: Largest gap [m].
        cores: Cores of all footprints, shape (n, k, 2) [m].
        radius: Their rounding radii, shape (n,) [m].
        movable: Which of them can move, shape (n,).
        footprints: Filled with the two footprints of each contact, ROBOT for the disc,
            shape (CONTACTS, 2).
        normals: Filled with unit vectors from the first into the second.
        points: Filled with the touching points [m].
        gaps: Filled with the gaps [m].

    Returns:
        The number of contacts.
    """
    n, count = len(radius), 0
    centres, spread = np.empty((n, 2)), np.empty(n)
    _bounds(cores, radius, centres, spread)
    queue, known, done = np.empty(n, np.int64), np.zeros(n, np.bool_), 0
    waiting = 0
    for i in range(n):
        gap, nx, ny = surface(position[0], position[1], cores[i], radius[i])
        if gap - disc_m > reach_m or count == CONTACTS:
            continue
        footprints[count, 0], footprints[count, 1] = ROBOT, i
        normals[count, 0], normals[count, 1] = -nx, -ny
        points[count, 0] = position[0] - gap * nx
        points[count, 1] = position[1] - gap * ny
        gaps[count] = gap - disc_m
        count += 1
        if movable[i]:
            known[i] = True
            queue[waiting] = i
            waiting += 1
    while done < waiting:
        i = queue[done]
        done += 1
        for j in range(n):
            if j == i or (known[j] and _is_before(queue, done - 1, j)):
                continue
            dx, dy = centres[j, 0] - centres[i, 0], centres[j, 1] - centres[i, 1]
            apart = spread[i] + spread[j] + reach_m
            if dx * dx + dy * dy > apart * apart:
                continue
            before = count
            count = _between(
                i, j, reach_m, cores, radius, footprints, normals, points, gaps, count
            )
            if count > before and movable[j] and not known[j]:
                known[j] = True
                queue[waiting] = j
                waiting += 1
    return count


@kernel
def _is_before(queue: NDArray[np.int64], end: int, j: int) -> bool:
    for k in range(end):
        if queue[k] == j:
            return True
    return False


@kernel
def _bounds(cores: Array, radius: Array, centres: Array, spread: Array) -> None:
    """Fill in centre and radius of a disc around each footprint."""
    k = cores.shape[1]
    for i in range(cores.shape[0]):
        x = y = 0.0
        for e in range(k):
            x += cores[i, e, 0]
            y += cores[i, e, 1]
        x, y = x / k, y / k
        largest = 0.0
        for e in range(k):
            dx, dy = cores[i, e, 0] - x, cores[i, e, 1] - y
            largest = max(largest, dx * dx + dy * dy)
        centres[i, 0], centres[i, 1] = x, y
        spread[i] = math.sqrt(largest) + radius[i]


@kernel
def _between(
    i: int,
    j: int,
    reach_m: float,
    cores: Array,
    radius: Array,
    footprints: NDArray[np.int64],
    normals: Array,
    points: Array,
    gaps: Array,
    count: int,
) -> int:
    """Add the contacts of two footprints; return the new count."""
    found = np.empty((2 * cores.shape[1], 5))
    if radius[i] == 0.0 and radius[j] == 0.0:
        n = _faces(cores[i], cores[j], found)
    else:
        n = _vertices(cores[i], radius[i], cores[j], radius[j], found)
    for k in range(n):
        if found[k, 4] > reach_m or count == CONTACTS:
            continue
        footprints[count, 0], footprints[count, 1] = i, j
        normals[count, 0], normals[count, 1] = found[k, 0], found[k, 1]
        points[count, 0], points[count, 1] = found[k, 2], found[k, 3]
        gaps[count] = found[k, 4]
        count += 1
    return count


@kernel
def _vertices(a: Array, a_m: float, b: Array, b_m: float, found: Array) -> int:
    """Return the contacts of rounded footprints: normal, point and gap of each."""
    n = 0
    for turn in range(2):
        sign = -1.0 if turn == 0 else 1.0
        mine, other = (a, b) if turn == 0 else (b, a)
        mine_m, other_m = (a_m, b_m) if turn == 0 else (b_m, a_m)
        for e in range(mine.shape[0]):
            x, y = mine[e, 0], mine[e, 1]
            if e and x == mine[e - 1, 0] and y == mine[e - 1, 1]:
                continue  # Padding.
            gap, nx, ny = surface(x, y, other, other_m)
            found[n, 0], found[n, 1] = sign * nx, sign * ny
            found[n, 2], found[n, 3] = x - mine_m * nx, y - mine_m * ny
            found[n, 4] = gap - mine_m
            n += 1
    return n


@kernel
def _faces(a: Array, b: Array, found: Array) -> int:
    """Return the contacts of polygons: where the nearest faces overlap, two or one.

    The normal is that of the edge that separates them most, or overlaps least.
    """
    a_edge, a_gap = _separation(a, b)
    b_edge, b_gap = _separation(b, a)
    if a_gap >= b_gap:
        return _clipped(a, a_edge, b, 1.0, found)
    return _clipped(b, b_edge, a, -1.0, found)


@kernel
def _separation(a: Array, b: Array) -> tuple[int, float]:
    """Return the edge of a that separates b most, and by how much."""
    best, edge = -math.inf, 0
    k = a.shape[0]
    for e in range(k):
        f = e + 1 if e + 1 < k else 0
        nx, ny = a[f, 1] - a[e, 1], a[e, 0] - a[f, 0]
        length = math.sqrt(nx * nx + ny * ny)
        if length == 0.0:
            continue
        least = math.inf
        for v in range(b.shape[0]):
            out = ((b[v, 0] - a[e, 0]) * nx + (b[v, 1] - a[e, 1]) * ny) / length
            least = min(least, out)
        if least > best:
            best, edge = least, e
    return edge, best


@kernel
def _clipped(face: Array, e: int, other: Array, sign: float, found: Array) -> int:
    """Return the contacts of an edge of `face` with the facing edge of `other`."""
    f = e + 1 if e + 1 < face.shape[0] else 0
    tx, ty = face[f, 0] - face[e, 0], face[f, 1] - face[e, 1]
    length = math.sqrt(tx * tx + ty * ty)
    tx, ty = tx / length, ty / length
    nx, ny = ty, -tx
    g, h = _facing(other, nx, ny)
    gx, gy = other[g, 0] - face[e, 0], other[g, 1] - face[e, 1]
    hx, hy = other[h, 0] - face[e, 0], other[h, 1] - face[e, 1]
    g_along, g_out = gx * tx + gy * ty, gx * nx + gy * ny
    h_along, h_out = hx * tx + hy * ty, hx * nx + hy * ny
    low, high = min(g_along, h_along), max(g_along, h_along)
    low, high = max(low, 0.0), min(high, length)
    if high < low:  # Beside each other: corner by corner.
        low = high = min(max(0.5 * (low + high), 0.0), length)
    ends = 2 if high - low > _APART_M else 1
    for k in range(ends):
        along = low if k == 0 else high
        share = 0.0
        if h_along != g_along:
            share = min(max((along - g_along) / (h_along - g_along), 0.0), 1.0)
        out = g_out + share * (h_out - g_out)
        found[k, 0], found[k, 1] = sign * nx, sign * ny
        found[k, 2] = face[e, 0] + along * tx + out * nx
        found[k, 3] = face[e, 1] + along * ty + out * ny
        found[k, 4] = out
    return ends


@kernel
def _facing(core: Array, nx: float, ny: float) -> tuple[int, int]:
    """Return the ends of the edge that faces a normal most."""
    best, g, h = math.inf, 0, 0
    k = core.shape[0]
    for e in range(k):
        f = e + 1 if e + 1 < k else 0
        ex, ey = core[f, 1] - core[e, 1], core[e, 0] - core[f, 0]
        length = math.sqrt(ex * ex + ey * ey)
        if length > 0.0 and (ex * nx + ey * ny) / length < best:
            best, g, h = (ex * nx + ey * ny) / length, e, f
    return g, h
