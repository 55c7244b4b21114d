"""What Bug1 and Bug2 share: head for the goal, and follow the boundary that is hit.

Lumelsky, V. and Stepanov, A. "Path-planning strategies for a point mobile automaton
moving amidst unknown obstacles of arbitrary shape", Algorithmica 2, 1987.

Their automaton is a point that feels what it touches. Here the point is the robot's
centre among footprints dilated by the robot's radius and a margin, and it touches
the boundary of that set. The sensor sees far more than one control period ahead, so
near the robot the boundary of the *known* map is the true one; it is followed by
arc length, and traced anew from the robot's place whenever the map changes. The outer
wall is a boundary like any other.
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Literal

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.motion.path_tracking import Tracking, follow, remainder
from beacon_mj.planners.base import Planner
from beacon_mj.planners.bug.free_space import Contour, FreeSpace
from beacon_mj.planners.checks import expect, expect_between
from beacon_mj.planners.recovery import Recovery, give_up

#: What is left of a path when the next one begins [m].
_ARRIVED_M = 0.01
#: Paths that may end within one control step.
_MAX_TURNS = 4


@dataclass(frozen=True, kw_only=True, slots=True)
class BugConfig:
    """How a Bug planner moves; lengths in [m]."""

    #: Side to which the robot turns when it hits a boundary.
    turn: Literal["left", "right"] = "left"
    #: Distance that the disc keeps from footprints and walls.
    margin_m: float = 0.015
    #: Distance from its path that the robot may have in corners.
    tolerance_m: float = 0.005

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        sides = ("left", "right")
        expect("turn", self.turn, "left or right", self.turn in sides)
        expect_between("margin_m", self.margin_m, 0.001, 0.1)
        expect_between("tolerance_m", self.tolerance_m, 0.0005, self.margin_m)


class BoundaryPlanner(Planner[BugConfig]):
    """Motion to the goal until a hit, then whatever the subclass does there.

    Subclasses say which way to go along the boundary, and what follows at the end of
    that way. `_hit` is the last hit point, `_leave` where the last boundary was left:
    the robot heads for the goal on the straight line from there.
    """

    Config = BugConfig

    def reset(self, task: Task) -> None:
        """Forget everything and head for the goal from the start."""
        self._task = task
        self._recovery = Recovery(task)
        self._version = -1
        self._phase = "goal"
        self._failure: str | None = None
        self._leave = task.start_m
        self._hit = task.start_m
        self._lap_m = 0.0
        self.hits: list[Array] = []
        self._take(task.start_m[None])

    def act(self, observation: Observation) -> Command:
        """Follow the present path, and turn to the next one at its end."""
        recovery = self._recovery.command(observation)
        if recovery is not None:
            return recovery
        replanned = self._update(observation)
        tracking = self._track(observation)
        for _ in range(_MAX_TURNS):
            if self._failure is not None or tracking.remaining_m > _ARRIVED_M:
                break
            self._turn()
            tracking, replanned = self._track(observation), True
        if self._failure is not None:
            return give_up(self._failure)
        return self._command(tracking, replanned)

    @abstractmethod
    def _boundary_path(self, at: Array) -> Array:
        """Return the way along the boundary from the point `at` on it."""

    @abstractmethod
    def _boundary_done(self) -> None:
        """Decide what follows at the end of the way along the boundary."""

    def _update(self, observation: Observation) -> bool:
        """Trace the path anew if the map has changed; return whether it has."""
        if self._version == observation.map_version and not self._recovery.ended:
            return False
        self._version = observation.map_version
        self._free = FreeSpace(
            observation.footprints,
            self._task.workspace_m,
            self._task.radius_m + self.config.margin_m,
            reverse=self.config.turn == "right",
        )
        at = remainder(self._path, self._progress)[0]
        self._lap_m += self._progress
        on_boundary = self._phase != "goal"
        if on_boundary:
            at = observation.position_m if self._recovery.ended else at
            self._take(self._boundary_path(at))
        else:
            self._take(self._goal_path(at))
        return True

    def _turn(self) -> None:
        """Go on at the end of a path: hit a boundary, or what the subclass says."""
        if self._phase != "goal":
            self._boundary_done()
        elif self._clear_m < np.inf:
            self._phase, self._lap_m = "boundary", 0.0
            self._hit = self._snap(self._path[-1])
            self.hits.append(self._hit)
            self._take(self._boundary_path(self._hit))
        else:
            self._failure = "Stopped at the goal, but it does not count as reached."

    def _head_for_goal(self, leave: Array) -> None:
        """Leave the boundary at a point of it."""
        self._phase, self._leave = "goal", leave
        self._take(self._goal_path(leave))

    def _goal_path(self, at: Array) -> Array:
        """Straight line towards the goal, as far as it is free."""
        goal = self._task.goal_m
        away = goal - at
        length = float(np.hypot(*away))
        clear = self._free.ray(at, goal, self.config.tolerance_m)
        self._clear_m = clear if clear < length else np.inf
        return np.stack([at, at + away * min(clear / max(length, 1e-9), 1.0)])

    def _contour(self, at: Array) -> Contour:
        """Contour at a point; an empty one, and failure, if nothing is free."""
        contour = self._free.nearest(at)
        if contour is None:
            self._failure = "The known map has no free space."
            return Contour(np.stack([at, at]))
        return contour

    def _snap(self, point: Array) -> Array:
        """Nearest point of the nearest contour."""
        contour = self._contour(point)
        return np.asarray(contour.stretch(contour.project(point), 0.0)[0])

    def _lap_left(self, contour: Contour, at: Array) -> tuple[float, float]:
        """Arc length at a point, and how far it is forward to the hit point [m]."""
        start = contour.project(at)
        left = contour.between(start, contour.project(self._hit))
        if self._lap_m < 0.05 and left < 1e-6:
            left = contour.length_m
        if self._lap_m > 0.05 and left > contour.length_m - 1e-6:
            left = 0.0
        return start, left

    def _take(self, path: Array) -> None:
        """Follow a path from its beginning."""
        self._path, self._progress = path, 0.0

    def _track(self, observation: Observation) -> Tracking:
        """Advance along the path."""
        tracking = follow(
            self._path,
            observation.position_m,
            observation.velocity_mps,
            self._task,
            progress_m=self._progress,
            tolerance_m=self.config.tolerance_m,
        )
        self._progress = tracking.progress_m
        return tracking

    def _command(self, tracking: Tracking, replanned: bool) -> Command:
        """Return the command with its reason."""
        to_goal = self._phase == "goal"
        info = PlannerInfo(
            action="move" if to_goal else "follow",
            reason="Straight for the goal." if to_goal else "Along the boundary.",
            path_m=remainder(self._path, self._progress),
            replanned=replanned,
        )
        return Command(velocity_mps=tracking.velocity_mps, info=info)
