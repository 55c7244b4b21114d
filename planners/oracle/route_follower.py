"""Drives a route that leads through some obstacles, and pushes them along the way."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from beacon_mj.geometry import Array, Footprints
from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.motion.path_tracking import follow, remainder
from beacon_mj.motion.visibility_graph import shortest_path
from beacon_mj.planners.base import Planner
from beacon_mj.planners.recovery import Recovery, give_up

#: Room kept beside obstacles that are not to be touched; the widest that has a way [m].
MARGINS_M = (0.012, 0.004, 0.001)
#: Displacement of such an obstacle after which the route is planned anew [m].
_SHIFT_M = 0.003
#: Gap to the next obstacle to be pushed at which the robot slows down [m].
_BRAKE_GAP_M = 0.06


@dataclass(frozen=True, kw_only=True, slots=True)
class RouteDriverConfig:
    """One way to cross a world.

    Attributes:
        soft: Ids of the obstacles that the route may lead through.
        via_m: Points that the route visits first, in order [m].
        touch_mps: Speed at which each of the soft obstacles may be met, by id [m/s].
        push_mps: Speed while an obstacle is being pushed [m/s].
        max_steps: Control steps within which it must arrive; else it gives up early.
    """

    soft: frozenset[str] = frozenset()
    via_m: tuple[tuple[float, float], ...] = ()
    touch_mps: tuple[tuple[str, float], ...] = ()
    push_mps: float = 0.5
    max_steps: int = 1000


class RouteDriver(Planner[RouteDriverConfig]):
    """Follows the shortest path past what is hard, through what is soft.

    It gives up once anything is broken: a rehearsal with damage is of no use.
    """

    Config = RouteDriverConfig

    def reset(self, task: Task) -> None:
        """Start on a task."""
        self._task = task
        self._recovery = Recovery(task)
        self._path: Array | None = None
        self._progress = 0.0
        self._via = [np.array(p) for p in self.config.via_m]
        self._hard = Footprints()
        self._touch = dict(self.config.touch_mps)
        self._met: set[str] = set()

    def act(self, observation: Observation) -> Command:
        """Go on along the route."""
        if any(o.broken for o in observation.obstacles):
            return give_up("Something broke.")
        if observation.step + self._steps_left(observation) > self.config.max_steps:
            return give_up("Too slow.")
        recovery = self._recovery.command(observation)
        if recovery is not None:
            return recovery
        self._plan(observation)
        if self._path is None:
            return give_up("No way, even through what may be pushed.")
        tracking = follow(
            self._path, observation.position_m, observation.velocity_mps, self._task,
            progress_m=self._progress, speed_mps=self._speed(observation),
        )  # fmt: skip
        self._progress = tracking.progress_m
        info = PlannerInfo(action="follow", path_m=self._path)
        return Command(velocity_mps=tracking.velocity_mps, info=info)

    def _steps_left(self, observation: Observation) -> int:
        """Return the least number of control steps to the goal."""
        task = self._task
        distance = float(np.hypot(*(task.goal_m - observation.position_m)))
        step_m = task.speed_mps * task.control_period_s
        return max(math.ceil((distance - task.goal_tolerance_m) / step_m), 1)

    def _plan(self, observation: Observation) -> None:
        """Plan at first, and whenever something hard has moved."""
        soft = self.config.soft
        keep = [i for i, o in enumerate(observation.obstacles) if o.id not in soft]
        now = observation.footprints
        hard = Footprints(now.vertices[keep], now.radius[keep])
        if self._path is not None and not self._shifted(hard):
            return
        self._hard = hard
        path = self._route(observation)
        if path is not None:
            self._path, self._progress = path, 0.0

    def _shifted(self, hard: Footprints) -> bool:
        moved = np.abs(hard.vertices - self._hard.vertices).max(initial=0.0)
        return self._recovery.ended or bool(moved > _SHIFT_M)

    def _route(self, observation: Observation) -> Array | None:
        """Return the way through the points still to visit, or None."""
        here = observation.position_m
        if self._path is not None:
            left = [p for p in self._via if self._ahead(p)]
            self._via = left
        legs = [here, *self._via, self._task.goal_m]
        pieces: list[Array] = []
        for start, end in pairwise(legs):
            piece = way_past(self._hard, start, end, self._task)
            if piece is None:
                return None
            pieces.append(piece if not pieces else piece[1:])
        return np.concatenate(pieces)

    def _ahead(self, point: Array) -> bool:
        assert self._path is not None
        left = remainder(self._path, self._progress)
        return bool((np.hypot(*(left[1:] - point).T) < 1e-9).any())

    def _speed(self, observation: Observation) -> float:
        """Return the speed that what is near and soft allows [m/s]."""
        limit = self._task.speed_mps
        self._met |= {c.id for c in observation.contacts}
        if self._met and observation.contacts:
            limit = min(limit, self.config.push_mps)
        gaps = observation.footprints.distance(observation.position_m)
        gaps = gaps - self._task.radius_m
        for i in np.flatnonzero(gaps < _BRAKE_GAP_M):
            name = observation.obstacles[int(i)].id
            if name not in self._met:
                limit = min(limit, self._touch.get(name, limit))
        return limit


def way_past(hard: Footprints, start: Array, end: Array, task: Task) -> Array | None:
    """Return the shortest path that touches nothing hard, (m, 2) [m], or None.

    Where the robot is closer to something than the least margin, it may stay so.
    """
    own = min(float(hard.distance(p).min(initial=np.inf)) - 0.001 for p in (start, end))
    if own < 0.5 * task.radius_m:
        return None
    for margin in MARGINS_M:
        clearance = min(task.radius_m + margin, own)
        path = shortest_path(start, end, hard, clearance, task.workspace_m)
        if path is not None:
            return path
    return None
