"""The graph that grid searches run on, and the compiled loops of the searches.

The graph is the 8-connected grid of `beacon_mj.motion.grid`. Going from cell u to its
neighbour v costs

    c(u, v) = length(u, v) * (1 + cost[v])   [m]

and is impossible if u or v has cost inf, or if a diagonal step would cut the corner
of a blocked cell. Cells on the rim of the grid are always blocked.

A search keeps a record of `VERTEX` for each cell, `cells` (n,). The loops are those of
Koenig, S. and Likhachev, M. "D* Lite", AAAI 2002, optimised version (figure 4). The
names g, rhs, key and k_m are theirs; the heap `queue` is their U.

Shapes: n cells, c changed cells.
"""

import math
from typing import NamedTuple

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.jit import inlined, kernel
from beacon_mj.motion.grid import Cells
from beacon_mj.motion.indexed_heap import (
    Records,
    before,
    heap_put,
    heap_remove,
    heap_size,
)

#: What a search knows of a cell: its cost, g, rhs and its place in the heap.
VERTEX = np.dtype([("cost", "f8"), ("g", "f8"), ("rhs", "f8"), ("slot", "i8")])
#: Steps to the eight neighbours; the step at k ^ 1 leads back.
ROW_STEP = (0, 0, 1, -1, 1, -1, 1, -1)
COL_STEP = (1, -1, 0, 0, 1, -1, -1, 1)
_STEP_LENGTH = (1.0, 1.0, 1.0, 1.0, *[math.sqrt(2.0)] * 4)
#: Keeps the heuristic strictly below the true distance. With equality, rounding may
#: order a stale vertex behind the start and end the search before it is repaired.
_HEURISTIC_SCALE = 1.0 - 1e-6


_ROUNDING_M = 1e-9  #: By how much sums may be off.
_AT_ONCE = 64  #: Expansions between two looks at the cells that are wanted.


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


class Aim(NamedTuple):
    """What a search runs between, and the bound k_m by which its keys have aged [m]."""

    start: int
    goal: int
    k_m: float


@kernel
def start_over(cells: Records, queue: Records, goal: int) -> None:
    """Forget every g and rhs, and queue the goal."""
    for u in range(cells.shape[0]):
        cells[u]["g"] = np.inf
        cells[u]["rhs"] = np.inf
        cells[u]["slot"] = 0
    queue[0]["vertex"] = 0
    cells[goal]["rhs"] = 0.0
    heap_put(cells, queue, goal, 0.0, 0.0)


@kernel
def change_cells(
    cells: Records,
    queue: Records,
    lattice: Lattice,
    aim: Aim,
    changed: Cells,
    cost: Array,
    seen: Cells,
    batch: int,
) -> None:
    """Set costs, then the lookahead of every vertex with an edge they touch.

    `seen` (n,) holds for each vertex the last batch of changes that looked at it.
    """
    cols = lattice.cols
    rows = cells.shape[0] // cols
    for i in range(changed.shape[0]):
        row, col = changed[i] // cols, changed[i] % cols
        if 0 < row < rows - 1 and 0 < col < cols - 1:
            cells[changed[i]]["cost"] = cost[i]
    for i in range(changed.shape[0]):
        row, col = changed[i] // cols, changed[i] % cols
        for r in range(max(row - 1, 1), min(row + 2, rows - 1)):
            for c in range(max(col - 1, 1), min(col + 2, cols - 1)):
                u = r * cols + c
                if seen[u] != batch and u != aim.goal:
                    seen[u] = batch
                    cells[u]["rhs"] = lookahead(cells, lattice, u)
                    _update_vertex(cells, queue, lattice, aim, u)


@kernel
def compute(cells: Records, queue: Records, lattice: Lattice, aim: Aim) -> int:
    """ComputeShortestPath of the paper; returns the number of expansions."""
    expansions = 0
    while heap_size(queue) > 0 and not _settled(cells, queue, lattice, aim, aim.start):
        expansions += _expand(cells, queue, lattice, aim)
    return expansions


@kernel
def settle(
    cells: Records,
    queue: Records,
    lattice: Lattice,
    aim: Aim,
    wanted: Cells,
    away: Array,
    out: Array,
) -> int:
    """Search until the least cost-to-go + `away` (m,) of `wanted` (m,) is known.

    Fills `out` (m,) with costs to go, inf where there is none or it cannot be part of
    the least sum; returns the number of expansions.
    """
    expansions = 0
    while True:
        best, least_left = np.inf, np.inf
        top = queue[1]["key1"] if heap_size(queue) > 0 else np.inf
        for j in range(wanted.shape[0]):
            u = wanted[j]
            out[j] = np.inf
            if u != aim.goal and math.isinf(cells[u]["cost"]):
                continue
            if heap_size(queue) == 0 or _settled(cells, queue, lattice, aim, u):
                out[j] = cells[u]["rhs"]
                best = min(best, out[j] + away[j])
            else:
                # Keys never fall, so that this one's cannot be below the top.
                left = top - heuristic(lattice, aim.start, u) - aim.k_m + away[j]
                least_left = min(least_left, left)
        if least_left > best + _ROUNDING_M or math.isinf(least_left):
            return expansions
        for _ in range(_AT_ONCE):
            if heap_size(queue) > 0:
                expansions += _expand(cells, queue, lattice, aim)


@inlined
def _settled(
    cells: Records, queue: Records, lattice: Lattice, aim: Aim, u: int
) -> bool:
    """Whether the lookahead of u is its cost-to-go; the heap must not be empty."""
    g, rhs = cells[u]["g"], cells[u]["rhs"]
    low = min(g, rhs)
    key1 = low + heuristic(lattice, aim.start, u) + aim.k_m
    return rhs <= g and not before(queue[1]["key1"], queue[1]["key2"], key1, low)


@inlined
def _expand(cells: Records, queue: Records, lattice: Lattice, aim: Aim) -> int:
    """Take up the vertex with the least key; return 1 if it was expanded."""
    top1, top2 = queue[1]["key1"], queue[1]["key2"]
    u = queue[1]["vertex"]
    value = min(cells[u]["g"], cells[u]["rhs"])
    key1 = value + heuristic(lattice, aim.start, u) + aim.k_m
    if before(top1, top2, key1, value):
        heap_put(cells, queue, u, key1, value)
        return 0
    if cells[u]["g"] > cells[u]["rhs"]:
        _lower(cells, queue, lattice, aim, u)
    else:
        _raise(cells, queue, lattice, aim, u)
    return 1


@inlined
def _update_vertex(
    cells: Records, queue: Records, lattice: Lattice, aim: Aim, u: int
) -> None:
    """Queue u under its present key if it is inconsistent, else take it out."""
    g, rhs = cells[u]["g"], cells[u]["rhs"]
    if g == rhs:
        heap_remove(cells, queue, u)
    else:
        value = min(g, rhs)
        key1 = value + heuristic(lattice, aim.start, u) + aim.k_m
        heap_put(cells, queue, u, key1, value)


@inlined
def _lower(cells: Records, queue: Records, lattice: Lattice, aim: Aim, u: int) -> None:
    """Settle an over-consistent vertex and offer its neighbours the way through it."""
    g = cells[u]["rhs"]
    cells[u]["g"] = g
    heap_remove(cells, queue, u)
    if math.isinf(cells[u]["cost"]):
        return
    for k in range(8):
        s = u + ROW_STEP[k] * lattice.cols + COL_STEP[k]
        through = edge(cells, lattice, s, k ^ 1) + g
        if through < cells[s]["rhs"] and s != aim.goal:
            cells[s]["rhs"] = through
            _update_vertex(cells, queue, lattice, aim, s)


@inlined
def _raise(cells: Records, queue: Records, lattice: Lattice, aim: Aim, u: int) -> None:
    """Forget an under-consistent vertex; whoever relied on it looks again."""
    old = cells[u]["g"]
    cells[u]["g"] = np.inf
    for k in range(8 if cells[u]["cost"] < np.inf else 0):
        s = u + ROW_STEP[k] * lattice.cols + COL_STEP[k]
        rhs = cells[s]["rhs"]
        relied = rhs == edge(cells, lattice, s, k ^ 1) + old
        if relied and s != aim.goal and rhs < np.inf:
            cells[s]["rhs"] = lookahead(cells, lattice, s)
            _update_vertex(cells, queue, lattice, aim, s)
    _update_vertex(cells, queue, lattice, aim, u)


@kernel
def flood(cells: Records, queue: Records, lattice: Lattice) -> int:
    """Dijkstra's search over the grid from the heap; returns the expansions."""
    expansions = 0
    while heap_size(queue) > 0:
        expansions += 1
        u = queue[1]["vertex"]
        g = cells[u]["rhs"]
        cells[u]["g"] = g
        heap_remove(cells, queue, u)
        if math.isinf(cells[u]["cost"]):
            continue
        for k in range(8):
            s = u + ROW_STEP[k] * lattice.cols + COL_STEP[k]
            through = edge(cells, lattice, s, k ^ 1) + g
            if through < cells[s]["rhs"]:
                cells[s]["rhs"] = through
                heap_put(cells, queue, s, through, through)
    return expansions


@kernel
def descend(cells: Records, lattice: Lattice, aim: Aim) -> Cells:
    """Walk downhill in c(u, v) + g(v) from start to goal; empty if there is no way."""
    path = np.empty(cells.shape[0], dtype=np.int64)
    if math.isinf(cells[aim.start]["rhs"]):
        return path[:0]
    u = aim.start
    path[0] = u
    count = 1
    while u != aim.goal and count < path.shape[0]:
        best, following = np.inf, u
        for k in range(8):
            v = u + ROW_STEP[k] * lattice.cols + COL_STEP[k]
            if cells[v]["g"] < np.inf:
                value = edge(cells, lattice, u, k) + cells[v]["g"]
                if value < best:
                    best, following = value, v
        if following == u:
            return path[:0]
        u = following
        path[count] = u
        count += 1
    return path[:count]
