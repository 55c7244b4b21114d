"""Times to the goal from everywhere, on the known map, wary of what is unknown."""

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import Observation, Task
from beacon_mj.motion.dstar_lite import dijkstra
from beacon_mj.motion.grid import ClearanceField, Grid
from beacon_mj.numerics import norms

_CELL_M = 0.05
_MARGIN_M = 0.005  #: Room that a way must leave beside the disc [m].
_NEAR_M = 0.25  #: How far a free cell may be from where a time is asked for [m].


class TravelTimes:
    """Dijkstra's cost-to-go over the free cells, in seconds.

    Space that was never in range costs a premium: among obstacles the free-space
    assumption is optimistic, and a barrier seldom ends where sight does.

    Attributes:
        expansions: Vertices expanded since it was built.
    """

    def __init__(self, task: Task, unknown_premium: float) -> None:
        """Build the field of an empty, unknown workspace.

        Args:
            task: Workspace, goal and robot.
            unknown_premium: Extra cost of ways through unknown space [m/m].
        """
        self._task = task
        self._premium = unknown_premium
        self._inflation_m = task.radius_m + _MARGIN_M
        self._grid = Grid.cover(task.workspace_m, _CELL_M)
        self._field = ClearanceField(self._grid, self._inflation_m)
        self._unknown = np.ones(self._grid.size)
        self._all_known = False
        self._seconds = np.zeros(self._grid.size)
        self.expansions = 0

    def note_range(self, position: Array) -> None:
        """Remember what is in range of a position, shape (2,) [m]."""
        if self._all_known:
            return
        reach = self._task.sensing_radius_m + self._task.radius_m
        self._unknown[self._grid.within(position, reach)] = 0.0
        self._all_known = not self._unknown.any()

    def update(self, observation: Observation) -> None:
        """Compute the times anew, all known obstacles blocking."""
        grid = self._grid
        self._field.update(observation.footprints)
        blocked = self._field.values < self._inflation_m
        cost = np.where(blocked, np.inf, self._premium * self._unknown)
        goal = self._nearest_free(self._task.goal_m, ~blocked)
        shape = grid.rows, grid.cols
        metres, expansions = dijkstra(cost.reshape(shape), grid.cell_m, goal)
        self.expansions += expansions
        self._seconds = metres.ravel() / self._task.speed_mps

    def from_point(self, point: Array) -> float:
        """Return the time to the goal from near a point (2,) [s], inf if cut off."""
        cells = self._grid.disc(point, _NEAR_M)
        away = norms(self._grid.centres(cells) - point) / self._task.speed_mps
        return float((self._seconds[cells] + away).min(initial=np.inf))

    def _nearest_free(self, point: Array, free: np.ndarray) -> int:
        cells = self._grid.disc(point, self._task.goal_tolerance_m)
        return int(cells[np.argmax(free[cells])])
