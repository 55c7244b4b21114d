"""How far a footprint can travel along a line until it touches another: exactly.

Polygons meet by the separating axes of both (Gottschalk 1996); rounded ones where a
vertex of one meets an edge of the other, or its vertex, at the sum of the radii.

Shapes: k core vertices, counter-clockwise. Lengths in [m].
"""

import math

from beacon_mj.geometry import Array
from beacon_mj.jit import kernel

#: Overlap up to which two footprints touch, rather than stand in each other [m].
_OVERLAP_M = 0.01
#: Overlap beside the way up to which a footprint passes another [m].
GRAZE_M = 1e-9


@kernel
def travel_gaps(
    i: int, ux: float, uy: float, cores: Array, radius: Array, out: Array
) -> None:
    """Fill `out` (n,) with the travel of footprint i until it touches each other one.

    Args:
        i: The footprint that moves.
        ux: Unit vector of its way, x.
        uy: The same, y.
        cores: All cores, padded by repeating the last vertex, shape (n, k, 2).
        radius: Rounding radii, shape (n,).
        out: Travel, infinite where they never touch; a little below zero where they
            overlap a little and i moves further in, shape (n,).
    """
    for j in range(cores.shape[0]):
        out[j] = math.inf
        if j == i:
            continue
        rounding = radius[i] + radius[j]
        if rounding == 0.0:
            out[j] = _polygons(cores[i], cores[j], ux, uy)
        else:
            out[j] = _rounded(cores[i], cores[j], rounding, ux, uy)


@kernel
def _polygons(a: Array, b: Array, ux: float, uy: float) -> float:
    """Return how far polygon a goes along u until it touches b."""
    enter, leave = -math.inf, math.inf
    for which in range(2):
        core = a if which == 0 else b
        k = core.shape[0]
        for e in range(k):
            f = e + 1 if e + 1 < k else 0
            nx, ny = core[f, 1] - core[e, 1], core[e, 0] - core[f, 0]
            length = math.sqrt(nx * nx + ny * ny)
            if length == 0.0:
                continue
            nx, ny = nx / length, ny / length
            a_low, a_high = _extent(a, nx, ny)
            b_low, b_high = _extent(b, nx, ny)
            speed = nx * ux + ny * uy
            if abs(speed) < GRAZE_M:
                if min(a_high, b_high) - max(a_low, b_low) <= GRAZE_M:
                    return math.inf
                continue
            first, last = (b_low - a_high) / speed, (b_high - a_low) / speed
            enter = max(enter, min(first, last))
            leave = min(leave, max(first, last))
    if leave - enter <= GRAZE_M or enter < -_OVERLAP_M:
        return math.inf
    return enter


@kernel
def _extent(core: Array, nx: float, ny: float) -> tuple[float, float]:
    """Return the least and largest projection of a core on an axis."""
    low = high = core[0, 0] * nx + core[0, 1] * ny
    for e in range(1, core.shape[0]):
        along = core[e, 0] * nx + core[e, 1] * ny
        low, high = min(low, along), max(high, along)
    return low, high


@kernel
def _rounded(a: Array, b: Array, rounding: float, ux: float, uy: float) -> float:
    """Return how far core a goes along u until it is `rounding` away from core b."""
    best = min(
        _vertices_to_edges(a, b, rounding, ux, uy),
        _vertices_to_edges(b, a, rounding, -ux, -uy),
    )
    limit = rounding - GRAZE_M
    for p in range(a.shape[0]):
        for q in range(b.shape[0]):
            wx, wy = b[q, 0] - a[p, 0], b[q, 1] - a[p, 1]
            along = wx * ux + wy * uy
            miss2 = wx * wx + wy * wy - along * along
            if along <= 0.0 or miss2 >= limit * limit:
                continue
            travel = along - math.sqrt(rounding * rounding - miss2)
            if -_OVERLAP_M <= travel < best:
                best = travel
    return best


@kernel
def _vertices_to_edges(
    a: Array, b: Array, rounding: float, ux: float, uy: float
) -> float:
    """Return how far the vertices of a go along u until one is near an edge of b."""
    best = math.inf
    k = b.shape[0]
    for e in range(k):
        f = e + 1 if e + 1 < k else 0
        ex, ey = b[f, 0] - b[e, 0], b[f, 1] - b[e, 1]
        length = math.sqrt(ex * ex + ey * ey)
        if length == 0.0:
            continue
        nx, ny = ey / length, -ex / length
        speed = nx * ux + ny * uy
        if speed > -GRAZE_M:
            continue
        for p in range(a.shape[0]):
            wx, wy = a[p, 0] - b[e, 0], a[p, 1] - b[e, 1]
            travel = (rounding - (nx * wx + ny * wy)) / speed
            along = ((wx + travel * ux) * ex + (wy + travel * uy) * ey) / length
            if 0.0 <= along <= length and -_OVERLAP_M <= travel < best:
                best = travel
    return best
