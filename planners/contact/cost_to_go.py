"""Times to the goal, and from the robot, on the known map, wary of what is unknown."""

from collections.abc import Mapping

import numpy as np

from beacon_mj.geometry import Array, Mask
from beacon_mj.interface import Observation, Task
from beacon_mj.motion.field_search import FieldSearch, field_search
from beacon_mj.motion.grid import Cells, ClearanceField, Grid
from beacon_mj.numerics import norms
from beacon_mj.planners.contact.cost_map import CrossingCosts, without

_CELL_M = 0.05
_MARGIN_M = 0.005  #: Room that a way must leave beside the disc [m].
_NEAR_M = 0.25  #: How far a free cell may be from where a time is asked for [m].


class TravelTimes:
    """Costs to go over the free cells, in seconds.

    Space that was never in range costs a premium: among obstacles the free-space
    assumption is optimistic, and a barrier seldom ends where sight does.
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
        self._round = field_search(self._grid)
        self._beyond = field_search(self._grid)
        self._back = field_search(self._grid)

    @property
    def expansions(self) -> int:
        """Vertices expanded since it was built."""
        round_, beyond, back = self._round, self._beyond, self._back
        return round_.expansions + beyond.expansions + back.expansions

    def note_range(self, position: Array) -> None:
        """Remember what is in range of a position, shape (2,) [m]."""
        if self._all_known:
            return
        reach = self._task.sensing_radius_m + self._task.radius_m
        cells = self._grid.within(position, reach)
        fresh = cells[self._unknown[cells] > 0.0]
        if len(fresh):
            self._unknown[fresh] = 0.0
            self._round.note(fresh)
            self._beyond.note(fresh)
        self._all_known = not self._unknown.any()

    def update(self, observation: Observation, costs: Mapping[int, float]) -> None:
        """Take over the map, all known obstacles blocking.

        Args:
            observation: The map.
            costs: Cost per metre of going right through each obstacle that may be
                pushed, by its index; for `through` only.
        """
        self._observation, self._costs = observation, costs
        self._beyond_stale = self._back_stale = True
        changed = self._solid.update(observation.footprints)
        self._back.note(changed)
        self._round.note(changed)
        self._round.update(self._round_costs, self._near_goal(self._solid))

    def from_point(self, point: Array) -> float:
        """Return the time to the goal from near a point (2,) [s], inf if cut off."""
        return self._at(self._round, point)

    def through(self, point: Array) -> float:
        """Return the same, pushing what may be pushed at its cost."""
        if self._beyond_stale:
            self._beyond_stale = False
            footprints = without(self._observation.footprints, list(self._costs))
            self._beyond.note(self._fixed.update(footprints))
            self._beyond.note(self._crossing.update(self._observation, self._costs))
            self._beyond.update(self._beyond_costs, self._near_goal(self._fixed))
        return self._at(self._beyond, point)

    def to_point(self, point: Array) -> float:
        """Return the time from the robot to near a point (2,) [s], inf if cut off."""
        if self._back_stale:
            self._back_stale = False
            position = self._observation.position_m
            here = self._nearest_free(position, _NEAR_M, self._solid)
            self._back.update(self._back_costs, here)
        return self._at(self._back, point)

    def _round_costs(self, cells: Cells) -> Array:
        extra = self._premium * self._unknown[cells]
        return np.where(self._blocked(self._solid, cells), np.inf, extra)

    def _beyond_costs(self, cells: Cells) -> Array:
        extra = self._premium * self._unknown[cells] + self._crossing.extra[cells]
        return np.where(self._blocked(self._fixed, cells), np.inf, extra)

    def _back_costs(self, cells: Cells) -> Array:
        return np.where(self._blocked(self._solid, cells), np.inf, 0.0)

    def _blocked(self, field: ClearanceField, cells: Cells) -> Mask:
        return np.asarray(field.values[cells] < self._inflation_m)

    def _at(self, search: FieldSearch, point: Array) -> float:
        cells = self._grid.disc(point, _NEAR_M)
        away_m = norms(self._grid.centres(cells) - point)
        metres = search.metres(cells, away_m, self._grid.cell(point))
        speed = self._task.speed_mps
        return float((metres / speed + away_m / speed).min(initial=np.inf))

    def _near_goal(self, field: ClearanceField) -> int:
        task = self._task
        return self._nearest_free(task.goal_m, task.goal_tolerance_m, field)

    def _nearest_free(self, point: Array, reach_m: float, field: ClearanceField) -> int:
        """Return the free cell nearest to a point; the nearest one if none is free."""
        cells = self._grid.disc(point, reach_m)
        return int(cells[np.argmax(~self._blocked(field, cells))])
