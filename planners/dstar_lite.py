"""D* Lite: the strongest planner that never touches anything on purpose."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from beacon_mj.following import follow, remainder
from beacon_mj.geometry import Array, Footprints
from beacon_mj.grid_route import GridRoute
from beacon_mj.observation import Command, Observation, Rationale, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.checks import expect, expect_between
from beacon_mj.planners.recovery import Recovery, give_up
from beacon_mj.shortcut import is_clear, length, shorten


@dataclass(frozen=True, kw_only=True, slots=True)
class DStarLiteConfig:
    """How `DStarLitePlanner` sees the world; lengths in [m]."""

    #: Edge length of a grid cell, halved twice where the map seems to be closed.
    cell_m: float = 0.05
    #: Distance that the disc keeps from footprints while there is room.
    margin_m: float = 0.015
    #: Distance that it keeps in the narrowest passages.
    tight_margin_m: float = 0.005
    #: Distance from its path that the robot may have in corners.
    tolerance_m: float = 0.005

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        expect_between("cell_m", self.cell_m, 0.01, 0.1)
        expect_between("margin_m", self.margin_m, 0.0, 0.1)
        expect_between("tight_margin_m", self.tight_margin_m, 0.0, self.margin_m)
        expect("tolerance_m", self.tolerance_m, "positive", self.tolerance_m > 0.0)


class DStarLitePlanner(Planner):
    """Incremental heuristic search on a uniform grid, obstacles infinite.

    Paper appendix A.C; Koenig, S. and Likhachev, M. "D* Lite", AAAI 2002. Space that
    has not been sensed is free. The search is repaired whenever the map changes; its
    path is pulled tight against the exact footprints and tracked at full speed, so
    that the baseline does not suffer from the grid's corners.

    Where the map leaves no way, the planner goes on with finer cells, then with still
    finer ones and less margin, and once these fail too it gives up.
    """

    Config: ClassVar[type[DStarLiteConfig]] = DStarLiteConfig
    config: DStarLiteConfig

    def reset(self, task: Task) -> None:
        """Forget everything and plan on the empty map."""
        self._task = task
        cfg = self.config
        self._levels = [
            (cfg.cell_m, cfg.margin_m),
            (cfg.cell_m / 2, cfg.margin_m),
            (cfg.cell_m / 4, cfg.tight_margin_m),
        ]
        self._next_level()
        self._path = self._route.plan(task.start_m, Footprints())
        self._recovery = Recovery(task)
        self._version = -1
        self._progress = 0.0

    def act(self, observation: Observation) -> Command:
        """Follow the path, repairing it first if the map has changed."""
        away = self._recovery.velocity(observation)
        if self._recovery.exhausted:
            return give_up(f"Got stuck {self._recovery.stalls} times.")
        if away is not None:
            reason = "No progress: away from what is near."
            rationale = Rationale(action="back_off", reason=reason)
            return Command(velocity_mps=away, rationale=rationale)
        expansions = self._replan(observation) if self._stale(observation) else None
        if self._path is None:
            room_mm = 1000.0 * self.config.tight_margin_m
            return give_up(f"The known map has no way with {room_mm:g} mm of room.")
        return self._track(self._path, observation, expansions)

    def _stale(self, observation: Observation) -> bool:
        """Whether the map has changed, or the robot is where no plan put it."""
        return self._version != observation.map_version or self._recovery.ended

    def _replan(self, observation: Observation) -> int:
        """Repair the search and take its path if it is better; return expansions."""
        position, footprints = observation.position_m, observation.footprints
        self._version = observation.map_version
        path = self._route.plan(position, footprints)
        expansions = self._route.last_expansions
        while path is None and self._levels:
            self._next_level()
            path = self._route.plan(position, footprints)
            expansions += self._route.last_expansions
        if path is not None:
            path = shorten(path, footprints, self._route.inflation_m)
        kept = self._kept(observation)
        if path is None or kept is None or length(path) < length(kept) - 0.01:
            self._path, self._progress = path, 0.0
        return expansions

    def _kept(self, observation: Observation) -> Array | None:
        """Return what is left of the present path, or None if it is blocked."""
        if self._path is None or self._recovery.ended:
            return None
        left = remainder(self._path, self._progress)
        joined = np.concatenate([observation.position_m[None], left[1:]])
        need = self._route.inflation_m - self.config.tolerance_m
        return left if is_clear(joined, observation.footprints, need) else None

    def _track(
        self, path: Array, observation: Observation, expansions: int | None
    ) -> Command:
        """Return the command that follows the path."""
        tracking = follow(
            path,
            observation.position_m,
            observation.velocity_mps,
            self._task,
            progress_m=self._progress,
            tolerance_m=self.config.tolerance_m,
        )
        self._progress = tracking.progress_m
        rationale = Rationale(
            action="move",
            reason="Along the shortest path on the known map.",
            path_m=remainder(path, self._progress),
            replanned=expansions is not None,
            expansions=expansions or 0,
        )
        return Command(velocity_mps=tracking.velocity_mps, rationale=rationale)

    def _next_level(self) -> None:
        """Start a search of its own with the next cell size and margin."""
        cell_m, margin_m = self._levels.pop(0)
        self._route = GridRoute(self._task, cell_m, self._task.radius_m + margin_m)
