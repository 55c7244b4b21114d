"""The graph that grid searches run on, and what they keep for each of its vertices.

The graph is the 8-connected grid of `beacon_mj.grid`. Going from cell u to its
neighbour v costs

    c(u, v) = length(u, v) * (1 + cost[v])   [m]

and is impossible if u or v has cost inf, or if a diagonal step would cut the corner
of a blocked cell. Cells on the rim of the grid are always blocked.
"""

import math
from typing import NamedTuple

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.heap import Heap
from beacon_mj.jit import kernel

#: Steps to the eight neighbours; the step at k ^ 1 leads back.
ROW_STEP = (0, 0, 1, -1, 1, -1, 1, -1)
COL_STEP = (1, -1, 0, 0, 1, -1, -1, 1)
_STEP_LENGTH = (1.0, 1.0, 1.0, 1.0, *[math.sqrt(2.0)] * 4)
#: Keeps the heuristic strictly below the true distance. With equality, rounding may
#: order a stale vertex behind the start and end the search before it is repaired.
_HEURISTIC_SCALE = 1.0 - 1e-6


class Search(NamedTuple):
    """Arrays that the kernels share; `cols` and `cell_m` describe the grid."""

    cost: Array
    g: Array
    rhs: Array
    heap: Heap
    cols: int
    cell_m: float


@kernel
def edge(search: Search, u: int, k: int) -> float:
    """Cost of going from u along step k [m]."""
    cost = search.cost
    v = u + ROW_STEP[k] * search.cols + COL_STEP[k]
    length: float = search.cell_m * _STEP_LENGTH[k] * (1.0 + cost[v])
    if math.isinf(cost[u]) or math.isinf(length):
        return np.inf
    if k >= 4 and (
        math.isinf(cost[u + COL_STEP[k]])
        or math.isinf(cost[u + ROW_STEP[k] * search.cols])
    ):
        return np.inf
    return length


@kernel
def lookahead(search: Search, u: int) -> float:
    """One-step lookahead value: the least c(u, v) + g(v) over the neighbours v."""
    best = np.inf
    if math.isinf(search.cost[u]):
        return best
    for k in range(8):
        v = u + ROW_STEP[k] * search.cols + COL_STEP[k]
        if search.g[v] < best:
            best = min(best, edge(search, u, k) + search.g[v])
    return best


@kernel
def heuristic(search: Search, u: int, v: int) -> float:
    """Octile distance [m], scaled down by a hair; a metric, so consistent."""
    rows = abs(u // search.cols - v // search.cols)
    cols = abs(u % search.cols - v % search.cols)
    octile: float = max(rows, cols) + (math.sqrt(2.0) - 1.0) * min(rows, cols)
    return _HEURISTIC_SCALE * search.cell_m * octile
