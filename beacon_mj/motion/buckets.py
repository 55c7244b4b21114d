"""A uniform grid of buckets: what lies where, so that few things are looked at.

Each square cell of the grid lists the boxes that meet it. A question about a place
then concerns the lists of a few cells, however many boxes there are. Answers do not
depend on the grid: it only leaves out what is too far away to matter.

Shapes: n boxes, c cells (rows * cols), m entries of all lists.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array, Footprints
from beacon_mj.jit import inlined, kernel

Indices = NDArray[np.int64]

SLACK_M = 1e-6  #: Boxes are this much larger than they must be, against rounding.
#: No more cells than this, however large the plane and small its boxes [cells].
_MOST_CELLS = 250_000


class Buckets(NamedTuple):
    """Boxes by the cells that they meet.

    Attributes:
        west: West edge of the first column [m].
        south: South edge of the first row [m].
        edge: Edge of a cell [m].
        rows: Number of rows.
        cols: Number of columns.
        begin: Where the list of each cell begins in `items`, shape (c + 1,).
        items: The lists, one after the other, shape (m,).
    """

    west: float
    south: float
    edge: float
    rows: int
    cols: int
    begin: Indices
    items: Indices


def bucketed(low: Array, high: Array, frame: tuple[Array, Array, float]) -> Buckets:
    """Return the buckets of boxes between two corners each.

    Args:
        low: South-west corners, shape (n, 2) [m].
        high: North-east corners, shape (n, 2) [m].
        frame: South-west and north-east corner of the plane (2,) [m], and about how
            large a cell should be [m]. What lies outside is listed at the rim.
    """
    (west, south), (east, north), edge = frame[0].tolist(), frame[1].tolist(), frame[2]
    edge = max(edge, math.sqrt((east - west) * (north - south) / _MOST_CELLS), SLACK_M)
    cols = max(1, math.ceil((east - west) / edge))
    rows = max(1, math.ceil((north - south) / edge))
    begin, items = _listed(low, high, west, south, edge, rows, cols)
    return Buckets(west, south, edge, rows, cols, begin, items)


def boxes(footprints: Footprints, reach_m: float) -> tuple[Array, Array]:
    """Return the corners (n, 2) of boxes around footprints grown by `reach_m` [m]."""
    grown = (footprints.radius + (reach_m + SLACK_M))[:, None]
    vertices = footprints.vertices
    return vertices.min(axis=1) - grown, vertices.max(axis=1) + grown


@inlined
def cell_at(value: float, origin: float, edge: float, count: int) -> int:
    """Return the row or column of a coordinate, that at the rim for one outside."""
    place = (value - origin) / edge
    if place <= 0.0:
        return 0
    return min(int(place), count - 1)


@kernel
def _listed(
    low: Array,
    high: Array,
    west: float,
    south: float,
    edge: float,
    rows: int,
    cols: int,
) -> tuple[Indices, Indices]:
    """Return `begin` and `items`; each list is in the order of the boxes."""
    begin = np.zeros(rows * cols + 1, dtype=np.int64)
    items = np.zeros(0, dtype=np.int64)
    for counting in (True, False):
        for i in range(low.shape[0]):
            c0 = cell_at(low[i, 0], west, edge, cols)
            c1 = cell_at(high[i, 0], west, edge, cols)
            r1 = cell_at(high[i, 1], south, edge, rows)
            for row in range(cell_at(low[i, 1], south, edge, rows), r1 + 1):
                for cell in range(row * cols + c0, row * cols + c1 + 1):
                    if counting:
                        begin[cell + 1] += 1
                    else:
                        items[begin[cell]] = i
                        begin[cell] += 1
        if counting:
            for cell in range(rows * cols):
                begin[cell + 1] += begin[cell]
            items = np.zeros(begin[rows * cols], dtype=np.int64)
    for cell in range(rows * cols, 0, -1):
        begin[cell] = begin[cell - 1]
    begin[0] = 0
    return begin, items
