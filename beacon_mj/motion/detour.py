"""The way round: a collision-free path to the goal, repaired as the map changes."""

import numpy as np

from beacon_mj.geometry import Array, polyline_length
from beacon_mj.interface import Observation, Task
from beacon_mj.motion.grid_route import GridRoute
from beacon_mj.motion.path_tracking import follow, remainder
from beacon_mj.motion.string_pulling import is_clear, shorten


class FreeRoute:
    """Shortest any-angle path on the known map, by D* Lite and string pulling.

    Attributes:
        path: What was planned last, shape (m, 2) [m]; None if there is no way.
        replanned: Whether the last `update` planned anew.
    """

    def __init__(
        self, task: Task, cell_m: float, margin_m: float, tolerance_m: float = 0.005
    ) -> None:
        """Plan for the task's disc.

        Args:
            task: Workspace, goal and robot.
            cell_m: Edge length of a grid cell [m].
            margin_m: Distance that the disc keeps from footprints [m].
            tolerance_m: Distance from its path that the robot may have in corners [m].
        """
        self._task = task
        self._route = GridRoute(task, cell_m, task.radius_m + margin_m)
        self._tolerance_m = tolerance_m
        self._progress = 0.0
        self._version = -1
        self.path: Array | None = None
        self.replanned = False

    @property
    def expansions(self) -> int:
        """Vertices expanded since it was built."""
        return self._route.expansions

    @property
    def inflation_m(self) -> float:
        """Distance that the path's points keep from footprints [m]."""
        return self._route.inflation_m

    @property
    def length_m(self) -> float:
        """Length of what is left of the path [m], infinite if there is none."""
        if self.path is None:
            return float("inf")
        return polyline_length(remainder(self.path, self._progress))

    def update(self, observation: Observation, *, force: bool = False) -> None:
        """Plan anew if the map has changed, or if forced to."""
        self.replanned = force or self._version != observation.map_version
        if not self.replanned:
            return
        self._version = observation.map_version
        position, footprints = observation.position_m, observation.footprints
        path = self._route.plan(position, footprints)
        if path is not None:
            path = shorten(path, footprints, self.inflation_m)
        kept = None if force else self._kept(observation)
        if (
            path is None
            or kept is None
            or polyline_length(path) < polyline_length(kept) - 0.01
        ):
            self.path, self._progress = path, 0.0

    def left(self) -> Array | None:
        """Return what is left of the path, shape (p, 2) [m], or None."""
        return None if self.path is None else remainder(self.path, self._progress)

    def velocity(self, observation: Observation) -> Array:
        """Return the velocity that follows the path, shape (2,) [m/s]."""
        if self.path is None:
            return np.zeros(2)
        tracking = follow(
            self.path,
            observation.position_m,
            observation.velocity_mps,
            self._task,
            progress_m=self._progress,
            tolerance_m=self._tolerance_m,
        )
        self._progress = tracking.progress_m
        return tracking.velocity_mps

    def _kept(self, observation: Observation) -> Array | None:
        """Return what is left of the present path, or None if it is blocked."""
        left = self.left()
        if left is None:
            return None
        joined = np.concatenate([observation.position_m[None], left[1:]])
        need = self.inflation_m - self._tolerance_m
        return left if is_clear(joined, observation.footprints, need) else None
