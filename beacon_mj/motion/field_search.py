"""Costs to go of a few cells to one root, over a grid whose costs change.

Two ways to the same numbers: `WholeSearch` searches the whole grid anew, which takes
milliseconds where rooms are small; `RepairedSearch` repairs the last search, and only
as far as the cells that are asked for need it.

Shapes: n cells of the grid, c changed cells, m cells asked for.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.motion.dstar_lite import DStarLite, dijkstra
from beacon_mj.motion.grid import Cells, Grid

#: Costs of entering cells besides their length, shape (m,), >= 0 or inf [m/m].
Costs = Callable[[Cells], Array]
WHOLE_CELLS = 50_000  #: Grids up to this size are searched whole.


class FieldSearch(Protocol):
    """Costs to go to one root."""

    @property
    def expansions(self) -> int:
        """Vertices expanded since it was built."""

    def note(self, changed: Cells) -> None:
        """Remember cells, shape (c,), whose cost may have changed."""

    def update(self, costs: Costs, root: int) -> None:
        """Take over the costs of all cells that were noted, and the root.

        Args:
            costs: Gives the costs of cells.
            root: Cell with cost-to-go zero.
        """

    def metres(self, cells: Cells, away_m: Array, near: int) -> Array:
        """Return the costs to go of cells, shape (m,) [m].

        They are exact where cost-to-go and `away_m` have the least sum, else exact or
        inf.

        Args:
            cells: The cells, shape (m,).
            away_m: What is added to each, shape (m,) [m].
            near: A cell near to them.
        """


def field_search(grid: Grid) -> FieldSearch:
    """Return the search that suits a grid."""
    if grid.size <= WHOLE_CELLS:
        return WholeSearch(grid)
    return RepairedSearch(grid)


class WholeSearch:
    """Dijkstra's search over the whole grid at each update."""

    def __init__(self, grid: Grid) -> None:
        """Search nothing yet."""
        self._grid = grid
        self._all = np.arange(grid.size)
        self._metres = np.zeros(grid.size)
        self.expansions = 0

    def note(self, changed: Cells) -> None:
        """Nothing: all cells are searched; see `FieldSearch`."""

    def update(self, costs: Costs, root: int) -> None:
        """Search anew; see `FieldSearch`."""
        shape, cell_m = (self._grid.rows, self._grid.cols), self._grid.cell_m
        metres, expansions = dijkstra(costs(self._all).reshape(shape), cell_m, root)
        self._metres = metres.ravel()
        self.expansions += expansions

    def metres(self, cells: Cells, away_m: Array, near: int) -> Array:
        """Return the costs to go of cells; see `FieldSearch`."""
        return np.asarray(self._metres[cells])


class RepairedSearch:
    """D* Lite towards the cells that are asked for."""

    def __init__(self, grid: Grid) -> None:
        """Search nothing yet, on a grid without costs."""
        self._engine = DStarLite(np.zeros((grid.rows, grid.cols)), grid.cell_m)
        self._noted: list[Cells] | None = None  # All cells, at first.

    @property
    def expansions(self) -> int:
        """Vertices expanded since it was built."""
        return self._engine.expansions

    def note(self, changed: Cells) -> None:
        """Remember what changed; see `FieldSearch`."""
        if self._noted is not None:
            self._noted.append(changed)

    def update(self, costs: Costs, root: int) -> None:
        """Hand on what changed; see `FieldSearch`."""
        engine = self._engine
        if root != engine.goal:
            engine.set_goal(root)
        if engine.start < 0:
            engine.move_start(root)
        if self._noted is None:
            cells = np.arange(len(engine.cost))
        else:
            cells = np.unique(np.concatenate(self._noted))
        self._noted = [cells[:0]]
        cost = costs(cells)
        differs = cost != engine.cost[cells]
        if differs.any():
            engine.update_cells(cells[differs], cost[differs])

    def metres(self, cells: Cells, away_m: Array, near: int) -> Array:
        """Search on until what was not reached cannot matter; see `FieldSearch`."""
        self._engine.move_start(near)
        return self._engine.costs_near(cells, away_m)
