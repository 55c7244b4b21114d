"""Paths of a disc between free points of the workspace, repaired as the map changes.

Ties together the clearance field, the incremental search and the points that do not
lie on cell centres: where the robot is, and where it must go.
"""

from typing import NamedTuple

import numpy as np

from beacon_mj.geometry import Array, Footprints
from beacon_mj.interface import Task
from beacon_mj.motion.dstar_lite import DStarLite
from beacon_mj.motion.grid import Cells, ClearanceField, Grid
from beacon_mj.motion.string_pulling import is_clear

#: How far from the robot a free cell may be when it has strayed too near something.
_ESCAPE_M = 0.4


class Extra(NamedTuple):
    """What entering cells costs besides their length.

    Attributes:
        cost: Of each cell, shape (n,), >= 0 [m/m].
        changed: Cells whose cost may have changed since the last plan, shape (c,).
    """

    cost: Array
    changed: Cells


class GridRoute:
    """Shortest grid paths to the task's goal for a disc of a given radius.

    Attributes:
        inflation_m: Distance that the path's cells keep from footprints and walls [m].
        field: Clearance of each cell.
        engine: The incremental search.
    """

    def __init__(
        self, task: Task, cell_m: float, inflation_m: float, reach_m: float = 0.0
    ) -> None:
        """Build the search of an empty workspace.

        Args:
            task: Workspace and goal.
            cell_m: Edge length of a grid cell [m].
            inflation_m: Clearance below which a cell is blocked [m].
            reach_m: Clearance up to which `field` is exact, if more is wanted [m].
        """
        self._task = task
        self.inflation_m = inflation_m
        grid = Grid.cover(task.workspace_m, cell_m)
        self.field = ClearanceField(grid, max(inflation_m, reach_m))
        cost = np.where(self.field.values < inflation_m, np.inf, 0.0)
        self.engine = DStarLite(cost.reshape(grid.rows, grid.cols), cell_m)
        self._goals = grid.disc(task.goal_m, 0.8 * task.goal_tolerance_m)

    @property
    def expansions(self) -> int:
        """Vertices expanded since it was built."""
        return self.engine.expansions

    def plan(
        self, position: Array, footprints: Footprints, extra: Extra | None = None
    ) -> Array | None:
        """Bring the search up to date and return a path to the goal.

        Args:
            position: Where the robot is, shape (2,) [m].
            footprints: All known footprints.
            extra: Costs of cells besides their length; none by default.

        Returns:
            Polyline from the robot to the goal over cell centres, shape (m, 2) [m],
            or None if the goal cannot be reached. A robot that is too near something
            is first led out.
        """
        engine = self.engine
        changed = self.field.update(footprints)
        start, goal = self._start(position, footprints), self._free_goal()
        if goal != engine.goal:
            engine.set_goal(goal)
        engine.move_start(start)
        self._charge(changed, extra)
        reachable = np.isfinite(engine.compute())
        return self._polyline(position, footprints) if reachable else None

    def _charge(self, changed: Cells, extra: Extra | None) -> None:
        """Hand the costs that differ to the search."""
        costs: Array | float = 0.0
        if extra is not None:
            # In the order of the grid: where keys are equal, it decides.
            changed = np.unique(np.concatenate([changed, extra.changed]))
            costs = extra.cost[changed]
        cost = np.where(self.field.values[changed] < self.inflation_m, np.inf, costs)
        differs = cost != self.engine.cost[changed]
        if differs.any():
            self.engine.update_cells(changed[differs], cost[differs])

    def _free_goal(self) -> int:
        """Free cell nearest to the goal and within its tolerance, if there is one."""
        free = self.field.values[self._goals] >= self.inflation_m
        return int(self._goals[np.argmax(free)])

    def _start(self, position: Array, footprints: Footprints) -> int:
        """Nearest free cell that the robot can drive to in a straight line."""
        grid, values = self.field.grid, self.field.values
        here = grid.cell(position)
        for radius in (1.5 * grid.cell_m, _ESCAPE_M):
            cells = grid.disc(position, radius)
            cells = cells[values[cells] >= self.inflation_m]
            own = min(footprints.least_distance(position), self.inflation_m)
            need = max(own, 0.0) - 0.005
            for cell, centre in zip(cells[:20], grid.centres(cells[:20]), strict=True):
                if is_clear(np.stack([position, centre]), footprints, need):
                    return int(cell)
        return here

    def _polyline(self, position: Array, footprints: Footprints) -> Array:
        """Cell centres from start to goal, between exact ends where these are free."""
        points = self.field.grid.centres(self.engine.path())
        last = np.stack([points[-1], self._task.goal_m])
        if is_clear(last, footprints, self.inflation_m):
            points[-1] = self._task.goal_m
        return np.concatenate([position[None], points])
