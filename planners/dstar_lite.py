"""D* Lite: the strongest planner that never touches anything on purpose."""

from dataclasses import dataclass

from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.motion.expansions import ExpansionCount
from beacon_mj.planners.base import Planner
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.recovery import Recovery, give_up


@dataclass(frozen=True, kw_only=True, slots=True)
class DStarLiteConfig:
    """How `DStarLitePlanner` sees the world; lengths in [m]."""

    #: Edge length of a grid cell, halved twice where the map seems to be closed.
    cell_m: float = 0.05
    #: Distance that the disc keeps from footprints while there is room.
    margin_m: float = 0.01
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
        expect_between("tolerance_m", self.tolerance_m, 0.0005, 0.1)


class DStarLitePlanner(Planner[DStarLiteConfig]):
    """Incremental heuristic search on a uniform grid, obstacles infinite.

    Paper appendix A.C; Koenig, S. and Likhachev, M. "D* Lite", AAAI 2002. Space that
    has not been sensed is free. The search is repaired whenever the map changes; its
    path is pulled tight against the exact footprints and tracked at full speed, so
    that the baseline does not suffer from the grid's corners.

    Where the map leaves no way, the planner goes on with finer cells, then with still
    finer ones and less margin, and once these fail too it gives up.
    """

    Config = DStarLiteConfig

    def reset(self, task: Task) -> None:
        """Forget everything and plan on the empty map."""
        cfg = self.config
        self._levels = [
            (cfg.cell_m, cfg.margin_m),
            (cfg.cell_m / 2, cfg.margin_m),
            (cfg.cell_m / 4, cfg.tight_margin_m),
        ]
        self._task = task
        self._recovery = Recovery(task)
        self._count = ExpansionCount()
        self._next_level()

    def act(self, observation: Observation) -> Command:
        """Follow the path, repairing it first if the map has changed."""
        return self._count.charge(self._decide(observation))

    def _decide(self, observation: Observation) -> Command:
        recovery = self._recovery.command(observation)
        if recovery is not None:
            return recovery
        self._replan(observation)
        if self._route.path is None:
            room_mm = 1000.0 * self.config.tight_margin_m
            return give_up(f"The known map has no way with {room_mm:g} mm of room.")
        info = PlannerInfo(
            action="move",
            reason="Along the shortest path on the known map.",
            path_m=self._route.left(),
            replanned=self._route.replanned,
        )
        velocity = self._route.velocity(observation)
        return Command(velocity_mps=velocity, info=info)

    def _replan(self, observation: Observation) -> None:
        """Repair the search, refining it where there is no way."""
        self._route.update(observation, force=self._recovery.ended)
        while self._route.path is None and self._levels:
            self._next_level()
            self._route.update(observation)

    def _next_level(self) -> None:
        """Start a search of its own with the next cell size and margin."""
        cell_m, margin_m = self._levels.pop(0)
        tolerance_m = self.config.tolerance_m
        self._route = FreeRoute(self._task, cell_m, margin_m, tolerance_m)
        self._count.watch(self._route)
