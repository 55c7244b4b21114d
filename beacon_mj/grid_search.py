"""Shortest paths on a grid: D* Lite, repaired when costs change, and Dijkstra.

Cells are the vertices of the graph in `beacon_mj.grid_graph`, which defines c(u, v).

Koenig, S. and Likhachev, M. "D* Lite", AAAI 2002, optimised version (figure 4). The
names g, rhs, key and k_m are theirs.

Shapes: n cells, c changed cells.
"""

import math

import numpy as np

from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array
from beacon_mj.grid import Cells
from beacon_mj.grid_graph import (
    COL_STEP,
    ROW_STEP,
    Search,
    edge,
    heuristic,
    lookahead,
)
from beacon_mj.heap import Heap, before, heap_put, heap_remove
from beacon_mj.jit import kernel


class DStarLite:
    """Cost-to-go of a moving start to a fixed goal, kept up to date incrementally.

    Attributes:
        expansions: Vertices expanded since the engine was built.
        start: Cell that the search runs towards.
        goal: Cell with cost-to-go zero.
    """

    def __init__(self, cost: Array, cell_m: float) -> None:
        """Copy the costs of a grid; call `set_goal` and `move_start` next.

        Args:
            cost: Extra cost of entering each cell, >= 0 or inf, shape (rows, cols).
            cell_m: Edge length of a cell [m].
        """
        rows, cols = cost.shape
        if rows < 3 or cols < 3:
            raise PlannerError(
                f"Expected the grid to be at least 3 x 3 but it was {rows} x {cols}."
            )
        walled = np.full((rows, cols), np.inf)
        walled[1:-1, 1:-1] = cost[1:-1, 1:-1]
        n = rows * cols
        unknown = np.full(n, np.inf)
        self._search = Search(
            walled.ravel(), unknown, unknown.copy(), Heap.empty(n), cols, float(cell_m)
        )
        self._seen = np.zeros(n, dtype=np.int64)
        self._batch = 0
        self._k_m = 0.0
        self._last = self.start = self.goal = -1
        self.expansions = 0

    @property
    def cost(self) -> Array:
        """Extra cost of each cell, shape (n,). Read-only."""
        return self._search.cost

    def set_goal(self, cell: int) -> None:
        """Aim at another goal and forget the search, not the costs."""
        search = self._search
        search.g[:] = np.inf
        search.rhs[:] = np.inf
        search.heap.clear()
        search.rhs[cell] = 0.0
        self.goal, self._k_m, self._last = cell, 0.0, -1
        heap_put(search.heap, cell, 0.0, 0.0)

    def move_start(self, cell: int) -> None:
        """Put the start where the robot is now."""
        self.start = cell

    def update_cells(self, cells: Cells, cost: Array) -> None:
        """Change the costs of some cells.

        Args:
            cells: Which cells, shape (c,), each at most once.
            cost: Their new extra costs, shape (c,), >= 0 or inf.
        """
        self._rebase()
        self._batch += 1
        _change_cells(
            self._search,
            cells,
            np.ascontiguousarray(cost, dtype=np.float64),
            self._seen,
            self._batch,
            self.start,
            self.goal,
            self._k_m,
        )

    def compute(self) -> float:
        """Repair the search and return the start's cost-to-go [m], inf if none."""
        self._rebase()
        self.expansions += _compute(self._search, self.start, self.goal, self._k_m)
        return float(self._search.rhs[self.start])

    def path(self) -> Cells:
        """Cells of a shortest path from start to goal, empty if there is none."""
        return _path(self._search, self.start, self.goal)

    def _rebase(self) -> None:
        """Add to k_m how far the start has moved, so that old keys stay bounds."""
        if self.goal < 0 or self.start < 0:
            raise PlannerError("Expected the goal and the start to be set first.")
        if self._last >= 0 and self._last != self.start:
            self._k_m += heuristic(self._search, self._last, self.start)
        self._last = self.start


def dijkstra(cost: Array, cell_m: float, goal: int) -> Array:
    """Cost-to-go of every cell, searched from scratch.

    Args:
        cost: Extra cost of entering each cell, >= 0 or inf, shape (rows, cols).
        cell_m: Edge length of a cell [m].
        goal: Cell with cost-to-go zero.

    Returns:
        Cost-to-go, shape (rows, cols) [m]; inf where the goal cannot be reached.
    """
    engine = DStarLite(cost, cell_m)
    search = engine._search
    heap_put(search.heap, goal, 0.0, 0.0)
    search.rhs[goal] = 0.0
    _flood(search)
    return search.g.reshape(cost.shape)


@kernel
def _update_vertex(search: Search, u: int, start: int, k_m: float) -> None:
    """Queue u under its present key if it is inconsistent, else take it out."""
    g, rhs = search.g[u], search.rhs[u]
    if g == rhs:
        heap_remove(search.heap, u)
    else:
        value = min(g, rhs)
        heap_put(search.heap, u, value + heuristic(search, start, u) + k_m, value)


@kernel
def _change_cells(
    search: Search,
    cells: Cells,
    cost: Array,
    seen: Cells,
    batch: int,
    start: int,
    goal: int,
    k_m: float,
) -> None:
    """Set costs, then the lookahead of every vertex with an edge they touch."""
    rows = search.cost.shape[0] // search.cols
    for i in range(cells.shape[0]):
        row, col = cells[i] // search.cols, cells[i] % search.cols
        if 0 < row < rows - 1 and 0 < col < search.cols - 1:
            search.cost[cells[i]] = cost[i]
    for i in range(cells.shape[0]):
        row, col = cells[i] // search.cols, cells[i] % search.cols
        for r in range(max(row - 1, 1), min(row + 2, rows - 1)):
            for c in range(max(col - 1, 1), min(col + 2, search.cols - 1)):
                u = r * search.cols + c
                if seen[u] != batch and u != goal:
                    seen[u] = batch
                    search.rhs[u] = lookahead(search, u)
                    _update_vertex(search, u, start, k_m)


@kernel
def _compute(search: Search, start: int, goal: int, k_m: float) -> int:
    """ComputeShortestPath of the paper; returns the number of expansions."""
    g, rhs, heap = search.g, search.rhs, search.heap
    expansions = 0
    while heap.size[0] > 0:
        low = min(g[start], rhs[start])
        if rhs[start] <= g[start] and not before(
            heap.key1[0], heap.key2[0], low + k_m, low
        ):
            break
        u = heap.vertex[0]
        value = min(g[u], rhs[u])
        key1 = value + heuristic(search, start, u) + k_m
        if before(heap.key1[0], heap.key2[0], key1, value):
            heap_put(heap, u, key1, value)
            continue
        expansions += 1
        if g[u] > rhs[u]:
            g[u] = rhs[u]
            heap_remove(heap, u)
            _lower_neighbours(search, u, start, goal, k_m)
        else:
            _raise_neighbours(search, u, start, goal, k_m)
    return expansions


@kernel
def _lower_neighbours(
    search: Search, u: int, start: int, goal: int, k_m: float
) -> None:
    """Offer the neighbours of an over-consistent vertex the way through it."""
    if math.isinf(search.cost[u]):
        return
    for k in range(8):
        s = u + ROW_STEP[k] * search.cols + COL_STEP[k]
        through = edge(search, s, k ^ 1) + search.g[u]
        if through < search.rhs[s] and s != goal:
            search.rhs[s] = through
            _update_vertex(search, s, start, k_m)


@kernel
def _raise_neighbours(
    search: Search, u: int, start: int, goal: int, k_m: float
) -> None:
    """Forget an under-consistent vertex; whoever relied on it looks again."""
    old = search.g[u]
    search.g[u] = np.inf
    for k in range(8 if search.cost[u] < np.inf else 0):
        s = u + ROW_STEP[k] * search.cols + COL_STEP[k]
        relied = search.rhs[s] == edge(search, s, k ^ 1) + old
        if relied and s != goal and search.rhs[s] < np.inf:
            search.rhs[s] = lookahead(search, s)
            _update_vertex(search, s, start, k_m)
    _update_vertex(search, u, start, k_m)


@kernel
def _flood(search: Search) -> None:
    """Dijkstra's search over the whole grid, from what the heap holds."""
    g, rhs, heap = search.g, search.rhs, search.heap
    while heap.size[0] > 0:
        u = heap.vertex[0]
        g[u] = rhs[u]
        heap_remove(heap, u)
        if math.isinf(search.cost[u]):
            continue
        for k in range(8):
            s = u + ROW_STEP[k] * search.cols + COL_STEP[k]
            through = edge(search, s, k ^ 1) + g[u]
            if through < rhs[s]:
                rhs[s] = through
                heap_put(heap, s, through, through)


@kernel
def _path(search: Search, start: int, goal: int) -> Cells:
    """Walk downhill in c(u, v) + g(v) from start to goal."""
    cells = np.empty(search.cost.shape[0], dtype=np.int64)
    if math.isinf(search.rhs[start]):
        return cells[:0]
    u = start
    cells[0] = u
    count = 1
    while u != goal and count < cells.shape[0]:
        best, following = np.inf, u
        for k in range(8):
            v = u + ROW_STEP[k] * search.cols + COL_STEP[k]
            if search.g[v] < np.inf:
                value = edge(search, u, k) + search.g[v]
                if value < best:
                    best, following = value, v
        if following == u:
            return cells[:0]
        u = following
        cells[count] = u
        count += 1
    return cells[:count]
