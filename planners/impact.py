"""A* over a semantic contact-cost map that contact never revises, after IMPACT."""

import math
from dataclasses import dataclass

import numpy as np

from beacon_mj.geometry import Array, Mask
from beacon_mj.interface import (
    Command,
    Observation,
    PlannerInfo,
    Probabilities,
    SensedObstacle,
    Task,
)
from beacon_mj.motion.expansions import ExpansionCount
from beacon_mj.motion.path_tracking import follow, remainder
from beacon_mj.numerics import dot
from beacon_mj.planners.base import Planner
from beacon_mj.planners.checks import expect_all_between, expect_between
from beacon_mj.planners.contact.cost_map import ContactMap
from beacon_mj.planners.contact.way_through import way_through
from beacon_mj.planners.recovery import Recovery, give_up


@dataclass(frozen=True, kw_only=True, slots=True)
class ImpactConfig:
    """Costs of contact and how the robot moves; lengths in [m]."""

    #: Cost of driving through safe, movable, fragile, in metres per metre, 0 to 100.
    class_cost: Probabilities = (10.0, 1.0, 10.0)
    #: Expected cost above which an obstacle is not driven through at all.
    refusal_cost: float = 8.0
    #: Edge length of a grid cell.
    cell_m: float = 0.05
    #: Distance that the disc keeps from what it goes round.
    margin_m: float = 0.01
    #: Speed while the bumper touches, or is about to touch, something [m/s].
    contact_mps: float = 0.25

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        expect_all_between("class_cost", self.class_cost, 3, 0.0, 100.0)
        expect_between("refusal_cost", self.refusal_cost, 0.0, 100.0)
        expect_between("cell_m", self.cell_m, 0.01, 0.1)
        expect_between("margin_m", self.margin_m, 0.0, 0.1)
        expect_between("contact_mps", self.contact_mps, 0.01, 5.0)


class Impact(Planner[ImpactConfig]):
    """Contact tolerance per obstacle at first sight, a cost map, and A* over it.

        path = argmin sum over cells of (1 + sum_c s_i(c) cost(c)) * length

    Ling, Y. et al. "IMPACT: Intelligent Motion Planning with Acceptable Contact
    Trajectories via Vision-Language Models", arXiv 2503.10110, 2025: costs from 0 to
    10 say how badly each object tolerates contact, the path goes through whatever is
    cheap enough, and contact is not planned but happens along the path.

    What differs: the costs come from the class scores that every planner here gets,
    not from a vision-language model; the map is planar and, unlike that of their
    second version, the same in all directions; obstacles come into sight as the robot
    moves, so the path is searched again whenever the map changes. The search is D*
    Lite's, whose paths are A*'s. An obstacle keeps its first cost for good: what the
    bumper learns is not used. Where everything left is refused, refusals are lifted.
    """

    Config = ImpactConfig

    def reset(self, task: Task) -> None:
        """Forget everything."""
        self._task = task
        cfg = self.config
        self._map = ContactMap(task, cfg.cell_m, task.radius_m + cfg.margin_m)
        self._count = ExpansionCount(self._map)
        self._recovery = Recovery(task)
        self._costs: dict[str, float] = {}
        self._through = np.zeros(0, np.int64)
        self._path: Array | None = None
        self._progress = 0.0
        self._version = -1

    def act(self, observation: Observation) -> Command:
        """Follow the cheapest path, and push what stands on it."""
        return self._count.charge(self._decide(observation))

    def _decide(self, observation: Observation) -> Command:
        recovery = self._recovery.command(observation)
        if recovery is not None:
            return recovery
        stale = self._recovery.ended or self._version != observation.map_version
        if stale:
            self._plan(observation)
        if self._path is None:
            return give_up("The walls leave no way.")
        return self._track(self._path, observation, replanned=stale)

    def cost(self, obstacle: SensedObstacle) -> float:
        """Return an obstacle's expected cost by the scores of its first sighting.

        What seems too heavy for the robot costs what a safe one does.
        """
        if obstacle.id not in self._costs:
            scores = np.array(obstacle.scores) / math.fsum(obstacle.scores)
            expected = dot(scores, np.array(self.config.class_cost))
            if obstacle.perceived_force_n > self._task.force_max_n:
                expected = max(expected, self.config.class_cost[0])
            self._costs[obstacle.id] = expected
        return self._costs[obstacle.id]

    def _plan(self, observation: Observation) -> None:
        """Search the cost map, refusing nothing where there is no other way."""
        self._version = observation.map_version
        costs = np.array([self.cost(o) for o in observation.obstacles])
        refused = costs > self.config.refusal_cost
        path = self._searched(observation, costs, ~refused)
        if path is None:
            path = self._searched(observation, costs, np.ones(len(costs), np.bool_))
        self._path, self._progress = path, 0.0

    def _searched(
        self, observation: Observation, costs: Array, soft: Mask
    ) -> Array | None:
        """Return the cheapest path through the soft and past the other obstacles."""
        chosen = {int(i): float(costs[i]) for i in np.flatnonzero(soft)}
        radius, margin = self._task.radius_m, self.config.margin_m
        way = way_through(self._map, observation, chosen, radius, margin)
        if way is not None:
            self._through = way.through
        return None if way is None else way.path_m

    def _track(
        self, path: Array, observation: Observation, *, replanned: bool
    ) -> Command:
        """Return the command that follows the path, slower in contact."""
        near = observation.footprints.distance(observation.position_m)
        touching = [i for i in self._through if near[i] < self._task.radius_m + 0.06]
        contact = bool(touching or observation.contacts)
        tracking = follow(
            path,
            observation.position_m,
            observation.velocity_mps,
            self._task,
            progress_m=self._progress,
            speed_mps=self.config.contact_mps if contact else self._task.speed_mps,
        )
        self._progress = tracking.progress_m
        info = PlannerInfo(
            action="push" if touching else "move",
            reason="Along the cheapest path on the contact-cost map.",
            target=observation.obstacles[touching[0]].id if touching else None,
            path_m=remainder(path, self._progress),
            replanned=replanned,
        )
        return Command(velocity_mps=tracking.velocity_mps, info=info)
