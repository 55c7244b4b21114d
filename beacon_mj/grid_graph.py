"""The graph that grid searches run on, and what they keep for each of its vertices.

The graph is the 8-connected grid of `beacon_mj.grid`. Going from cell u to its
neighbour v costs

    c(u, v) = length(u, v) * (1 + cost[v])   [m]

and is impossible if u or v has cost inf, or if a diagonal step would cut the corner
of a blocked cell. Cells on the rim of the grid are always blocked.

A search keeps a record of `VERTEX` for each cell, `cells` (n,).
"""

import math
from typing import NamedTuple

import numpy as np

from beacon_mj.heap import Records
from beacon_mj.jit import inlined

#: What a search knows of a cell: its cost, g, rhs and its place in the heap.
VERTEX = np.dtype([("cost", "f8"), ("g", "f8"), ("rhs", "f8"), ("slot", "i8")])
#: Steps to the eight neighbours; the step at k ^ 1 leads back.
ROW_STEP = (0, 0, 1, -1, 1, -1, 1, -1)
COL_STEP = (1, -1, 0, 0, 1, -1, -1, 1)
_STEP_LENGTH = (1.0, 1.0, 1.0, 1.0, *[math.sqrt(2.0)] * 4)
#: Keeps the heuristic strictly below the true distance. With equality, rounding may
#: order a stale vertex behind the start and end the search before it is repaired.
_HEURISTIC_SCALE = 1.0 - 1e-6


class Lattice(NamedTuple):
    """Shape of the grid: its number of columns and the edge of a cell [m]."""

    cols: int
    cell_m: float


@inlined
def edge(cells: Records, lattice: Lattice, u: int, k: int) -> float:
    """Cost of going from u along step k [m]."""
    cols, cell_m = lattice
    v = u + ROW_STEP[k] * cols + COL_STEP[k]
    length: float = cell_m * _STEP_LENGTH[k] * (1.0 + cells[v]["cost"])
    if math.isinf(cells[u]["cost"]) or math.isinf(length):
        return np.inf
    if k >= 4 and (
        math.isinf(cells[u + COL_STEP[k]]["cost"])
        or math.isinf(cells[u + ROW_STEP[k] * cols]["cost"])
    ):
        return np.inf
    return length


@inlined
def lookahead(cells: Records, lattice: Lattice, u: int) -> float:
    """One-step lookahead value: the least c(u, v) + g(v) over the neighbours v."""
    best = np.inf
    if math.isinf(cells[u]["cost"]):
        return best
    for k in range(8):
        g = cells[u + ROW_STEP[k] * lattice.cols + COL_STEP[k]]["g"]
        if g < best:
            best = min(best, edge(cells, lattice, u, k) + g)
    return best


@inlined
def heuristic(lattice: Lattice, u: int, v: int) -> float:
    """Octile distance [m], scaled down by a hair; a metric, so consistent."""
    cols = lattice.cols
    rows = abs(u // cols - v // cols)
    columns = abs(u % cols - v % cols)
    octile: float = max(rows, columns) + (math.sqrt(2.0) - 1.0) * min(rows, columns)
    return _HEURISTIC_SCALE * lattice.cell_m * octile
