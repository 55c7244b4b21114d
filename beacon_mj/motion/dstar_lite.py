"""Shortest paths on a grid: D* Lite, repaired when costs change, and Dijkstra.

Koenig, S. and Likhachev, M. "D* Lite", AAAI 2002, optimised version (figure 4); the
graph and the loops are in `beacon_mj.motion.dstar_lite_kernels`.

Shapes: n cells, c changed cells.
"""

import numpy as np

from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array
from beacon_mj.motion.dstar_lite_kernels import (
    VERTEX,
    Aim,
    Lattice,
    change_cells,
    compute,
    descend,
    flood,
    heuristic,
    settle,
    start_over,
)
from beacon_mj.motion.grid import Cells
from beacon_mj.motion.indexed_heap import Records, empty_heap


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
        self._cells = np.zeros(n, dtype=VERTEX)
        self._cells["cost"] = walled.ravel()
        self._queue = empty_heap(n)
        self._lattice = Lattice(cols, float(cell_m))
        self._seen = np.zeros(n, dtype=np.int64)
        self._batch = 0
        self._k_m = 0.0
        self._last = self.start = self.goal = -1
        self.expansions = 0

    @property
    def cost(self) -> Array:
        """Extra cost of each cell, shape (n,). Read-only."""
        return self._cells["cost"]

    def set_goal(self, cell: int) -> None:
        """Aim at another goal and forget the search, not the costs."""
        self.goal, self._k_m, self._last = cell, 0.0, -1
        start_over(self._cells, self._queue, cell)

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
        cost = np.ascontiguousarray(cost, dtype=np.float64)
        change_cells(*self._state(), cells, cost, self._seen, self._batch)

    def compute(self) -> float:
        """Repair the search and return the start's cost-to-go [m], inf if none."""
        self._rebase()
        self.expansions += compute(*self._state())
        return float(self._cells[self.start]["rhs"])

    def costs_near(self, cells: Cells, away_m: Array) -> Array:
        """Repair the search until the least sum of cost-to-go and `away_m` is known.

        Args:
            cells: Cells near the start, shape (m,).
            away_m: What is added to the cost-to-go of each, shape (m,) [m].

        Returns:
            Costs to go, shape (m,) [m]; inf where there is none, and where it cannot be
            part of the least sum.
        """
        self._rebase()
        out = np.empty(len(cells))
        self.expansions += settle(*self._state(), cells, away_m, out)
        return out

    def costs_to_go(self) -> Array:
        """Search from the goal to every cell [m], inf where none; shape (n,)."""
        self.expansions += flood(self._cells, self._queue, self._lattice)
        return np.ascontiguousarray(self._cells["g"])

    def path(self) -> Cells:
        """Cells of a shortest path from start to goal, empty if there is none."""
        return descend(self._cells, self._lattice, self._aim())

    def _aim(self) -> Aim:
        """Return the ends of the search."""
        return Aim(self.start, self.goal, self._k_m)

    def _state(self) -> tuple[Records, Records, Lattice, Aim]:
        """Return what the loops work on."""
        return self._cells, self._queue, self._lattice, self._aim()

    def _rebase(self) -> None:
        """Add to k_m how far the start has moved, so that old keys stay bounds."""
        if self.goal < 0 or self.start < 0:
            raise PlannerError("Expected the goal and the start to be set first.")
        if self._last >= 0 and self._last != self.start:
            self._k_m += heuristic(self._lattice, self._last, self.start)
        self._last = self.start


def dijkstra(cost: Array, cell_m: float, goal: int) -> tuple[Array, int]:
    """Cost-to-go of every cell, searched from scratch.

    Args:
        cost: Extra cost of entering each cell, >= 0 or inf, shape (rows, cols).
        cell_m: Edge length of a cell [m].
        goal: Cell with cost-to-go zero.

    Returns:
        Cost-to-go, shape (rows, cols) [m], inf where the goal cannot be reached; and
        the number of vertices expanded.
    """
    engine = DStarLite(cost, cell_m)
    engine.set_goal(goal)
    return engine.costs_to_go().reshape(cost.shape), engine.expansions
