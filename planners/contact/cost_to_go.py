"""Times to the goal, and from the robot, on the known map, wary of what is unknown."""

from collections.abc import Mapping

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import Observation, Task
from beacon_mj.motion.dstar_lite import dijkstra
from beacon_mj.motion.grid import ClearanceField, Grid
from beacon_mj.numerics import norms
from beacon_mj.planners.contact.cost_map import CrossingCosts, without

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
        self._solid = ClearanceField(self._grid, self._inflation_m)
        self._fixed = ClearanceField(self._grid, self._inflation_m)
        self._crossing = CrossingCosts(self._grid, self._inflation_m)
        self._unknown = np.ones(self._grid.size)
        self._all_known = False
        self._seconds = np.zeros(self._grid.size)
        self._through: Array | None = None
        self._from_robot: Array | None = None
        self.expansions = 0

    def note_range(self, position: Array) -> None:
        """Remember what is in range of a position, shape (2,) [m]."""
        if self._all_known:
            return
        reach = self._task.sensing_radius_m + self._task.radius_m
        self._unknown[self._grid.within(position, reach)] = 0.0
        self._all_known = not self._unknown.any()

    def update(self, observation: Observation, costs: Mapping[int, float]) -> None:
        """Compute the times to the goal anew, all known obstacles blocking.

        Args:
            observation: The map.
            costs: Cost per metre of going right through each obstacle that may be
                pushed, by its index; for `through` only.
        """
        self._observation, self._costs = observation, costs
        self._through = self._from_robot = None
        self._solid.update(observation.footprints)
        self._blocked = self._solid.values < self._inflation_m
        extra = np.where(self._blocked, np.inf, self._premium * self._unknown)
        self._seconds = self._search(extra, self._near_goal(self._blocked))

    def from_point(self, point: Array) -> float:
        """Return the time to the goal from near a point (2,) [s], inf if cut off."""
        return self._at(self._seconds, point)

    def through(self, point: Array) -> float:
        """Return the same, pushing what may be pushed at its cost."""
        if self._through is None:
            footprints = without(self._observation.footprints, list(self._costs))
            self._fixed.update(footprints)
            blocked = self._fixed.values < self._inflation_m
            extra = self._premium * self._unknown
            extra += self._crossing.over_grid(self._observation, self._costs)
            extra[blocked] = np.inf
            self._through = self._search(extra, self._near_goal(blocked))
        return self._at(self._through, point)

    def to_point(self, point: Array) -> float:
        """Return the time from the robot to near a point (2,) [s], inf if cut off."""
        if self._from_robot is None:
            extra = np.where(self._blocked, np.inf, 0.0)
            position = self._observation.position_m
            here = self._nearest_free(position, _NEAR_M, self._blocked)
            self._from_robot = self._search(extra, here)
        return self._at(self._from_robot, point)

    def _search(self, extra: Array, root: int) -> Array:
        """Return the time between every cell and one of them, shape (n,) [s]."""
        shape = self._grid.rows, self._grid.cols
        metres, expansions = dijkstra(extra.reshape(shape), self._grid.cell_m, root)
        self.expansions += expansions
        return np.asarray(metres.ravel() / self._task.speed_mps)

    def _at(self, seconds: Array, point: Array) -> float:
        cells = self._grid.disc(point, _NEAR_M)
        away = norms(self._grid.centres(cells) - point) / self._task.speed_mps
        return float((seconds[cells] + away).min(initial=np.inf))

    def _near_goal(self, blocked: np.ndarray) -> int:
        task = self._task
        return self._nearest_free(task.goal_m, task.goal_tolerance_m, blocked)

    def _nearest_free(self, point: Array, reach_m: float, blocked: np.ndarray) -> int:
        """Return the free cell nearest to a point; the nearest one if none is free."""
        cells = self._grid.disc(point, reach_m)
        return int(cells[np.argmax(~blocked[cells])])
