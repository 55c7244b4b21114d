"""Bug2: follow the boundary only as far as the straight line from start to goal."""

import numpy as np
import shapely

from beacon_mj.geometry import Array
from beacon_mj.interface import Task
from beacon_mj.numerics import norm, norms
from beacon_mj.planners.bug.boundary import BoundaryPlanner

#: How much nearer to the goal than the hit point a leave point must be [m].
_CLOSER_M = 0.001


class Bug2(BoundaryPlanner):
    """Motion along the m-line, boundary following to the next closer point on it.

    Paper appendix A.B; Lumelsky and Stepanov 1987. The m-line runs from start to goal.
    A leave point is the first boundary point on it that is nearer to the goal than the
    hit point and from which the way along the m-line is free. Back at the hit point
    without one, the goal cannot be reached, and the planner gives up. With n_i the
    times that the m-line crosses boundary i of perimeter p_i, the path is no longer
    than D + sum_i n_i p_i / 2. An odd n_i, where the boundary parts start from goal and
    none can be reached, counts as n_i + 1.
    """

    def reset(self, task: Task) -> None:
        """Forget everything and draw the m-line."""
        super().reset(task)
        self._m_line = shapely.linestrings([task.start_m, task.goal_m])
        self._leaves = False

    def _boundary_path(self, at: Array) -> Array:
        """Forward to the first leave point, or else to the hit point."""
        contour = self._contour(at)
        start, left = self._lap_left(contour, at)
        lap = contour.stretch(start, left)
        crossings = self._leave_points(lap)
        self._leaves = len(crossings) > 0
        if not self._leaves:
            return lap
        arcs = shapely.line_locate_point(
            shapely.linestrings(lap), shapely.points(crossings)
        )
        return contour.stretch(start, float(arcs.min()))

    def _leave_points(self, lap: Array) -> Array:
        """Points of a way along the boundary where it may be left, shape (q, 2)."""
        goal = self._task.goal_m
        met = shapely.intersection(shapely.linestrings(lap), self._m_line)
        points = shapely.get_coordinates(met)
        closer = norm(goal - self._hit) - _CLOSER_M
        points = points[norms(goal - points) < closer]
        return np.asarray(points[self._free.is_open(points, goal)])

    def _boundary_done(self) -> None:
        """Head for the goal from the leave point, or give up at the hit point."""
        if self._leaves:
            self._head_for_goal(self._path[-1])
        else:
            self._failure = "Back at the hit point: the goal is cut off."
