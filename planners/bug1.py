"""Bug1: walk all the way round what is in the way, leave where the goal is nearest."""

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.planners.bug.boundary import BoundaryPlanner


class Bug1(BoundaryPlanner):
    """Full boundary traversal, then back to the boundary's point nearest to the goal.

    Paper appendix A.A; Lumelsky and Stepanov 1987. Complete: where the way to the goal
    is blocked at the leave point x_L itself, the goal cannot be reached, and the
    planner gives up. With D the distance from start to goal and p_i the perimeters of
    the boundaries hit, the path is no longer than D + 1.5 sum_i p_i.
    """

    def _boundary_path(self, at: Array) -> Array:
        """Once around, or the shorter way to the leave point."""
        contour = self._contour(at)
        if self._phase == "boundary":
            return contour.stretch(*self._lap_left(contour, at))
        here, there = contour.project(at), contour.project(self._task.goal_m)
        forward = contour.between(here, there)
        if forward <= 0.5 * contour.length_m:
            return contour.stretch(here, forward)
        return contour.stretch(there, contour.length_m - forward)[::-1].copy()

    def _boundary_done(self) -> None:
        """After the lap turn to the leave point, from there to the goal."""
        at = self._path[-1]
        if self._phase == "boundary":
            self._phase = "return"
            self._take(self._boundary_path(at))
            at = self._path[-1]
            if not self._free.is_open(np.stack([at]), self._task.goal_m)[0]:
                self._failure = "The goal is cut off by the boundary gone round."
        else:
            self._head_for_goal(at)
