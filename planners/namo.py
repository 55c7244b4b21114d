"""Navigation among movable obstacles: connect regions of free space by moving things.

Stilman, M. and Kuffner, J. J. "Navigation Among Movable Obstacles: Real-time Reasoning
in Complex Environments", International Journal of Humanoid Robotics 2(4), 2005.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from beacon_mj.geometry import Footprints
from beacon_mj.interface import Observation, SensedObstacle, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.numerics import norm
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.contact.belief_settings import BeliefSettings
from beacon_mj.planners.contact.candidates import STANDOFF_M, PushPlan, push_plans
from beacon_mj.planners.contact.cost_map import Crossing
from beacon_mj.planners.contact.decision import Decision
from beacon_mj.planners.contact.limits import (
    PushLimits,
    PushSettings,
    careful_limits,
)
from beacon_mj.planners.contact.loop import ContactPlanner
from beacon_mj.planners.contact.policy import PushPolicy
from beacon_mj.planners.regions import Door, Regions, nearest_door

_NEAR_M = 0.3  #: How far robot and goal may be from the region that they are in [m].
_OPEN_SHARE = 0.5  #: Share of a region that must be reached for it to be connected.


@dataclass(frozen=True, kw_only=True, slots=True)
class NamoConfig:
    """Parameters of `Namo`."""

    #: Room beside the disc that an opening must leave [m].
    clearance_m: float = 0.03
    #: Distances by which a push is tried beyond what a crossing needs [m].
    extra_m: tuple[float, float] = (0.0, 0.3)
    #: Most obstacles that one plan moves.
    most_pushes: int = 3
    #: Travel of a push that the search for doors expects [m].
    usual_push_m: float = 0.5
    #: How fast, and how carefully, it pushes.
    push: PushSettings = PushSettings()

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        expect_between("clearance_m", self.clearance_m, 0.0, 0.5)
        for extra in self.extra_m:
            expect_between("extra_m", extra, 0.0, 2.0)
        expect_between("most_pushes", self.most_pushes, 1, 10)
        expect_between("usual_push_m", self.usual_push_m, 0.0, 2.0)


class NamoPolicy(PushPolicy[NamoConfig]):
    """Push only where the goal is in another region; then what costs least work."""

    Config = NamoConfig

    def reset(self, task: Task) -> None:
        """Forget everything and start on `task`."""
        super().reset(task)
        self._may: dict[str, float] = {}
        self._maps = 0

    @property
    def belief_settings(self) -> BeliefSettings:
        """What an obstacle seemed at first sight it remains, unless it withstood."""
        return BeliefSettings(memory="failures")

    @property
    def expansions(self) -> int:
        """Maps that were taken apart into regions since `reset`."""
        return self._maps

    def crossing_cost(
        self, obstacle: SensedObstacle, *, last_resort: bool
    ) -> float | None:
        """Return F_i / kappa_d [m/m] of what seems movable; as a last resort of all.

        The loop asks this of everything that it would let be pushed, before it asks
        `choose`, which goes by the answers.
        """
        if not (last_resort or self._movable(obstacle)):
            return None
        cost = self.force_n(obstacle) / self.task.motion_cost_jpm
        self._may[obstacle.id] = cost
        return cost

    def choose(
        self,
        observation: Observation,
        options: Iterator[list[PushPlan]],
        detour: FreeRoute,
    ) -> Decision | None:
        """Return the first push of a plan, where goal and robot are in two regions."""
        may, self._may = self._may, {}
        if detour.path is not None or not may:
            return None
        costs = {i: may[o.id] for i, o in enumerate(observation.obstacles)
                 if o.id in may}  # fmt: skip
        plan = self._select_connect(observation, costs, self.config.most_pushes)
        if not plan:
            return None
        work = self._work_m(observation, plan[0])
        reason = f"Opens the next of {len(plan)} regions, with the least work found."
        return Decision(plan[0], work, math.inf, {"work_m": work}, reason)

    def limits(self, observation: Observation, plan: PushPlan) -> PushLimits:
        """Touch slowly where something may break."""
        obstacle = observation.obstacles[plan.index]
        fragility = self.beliefs.fragility(plan.moved(observation))
        return careful_limits(
            obstacle, self.force_n(obstacle), fragility, self.task, self.config.push
        )

    def _movable(self, obstacle: SensedObstacle) -> bool:
        """Whether movable is the class that an obstacle most likely is of."""
        light = self.force_n(obstacle) <= self.task.force_max_n
        return light and int(np.argmax(self.beliefs.beliefs[obstacle.id])) == 1

    def _select_connect(
        self, world: Observation, costs: Mapping[int, float], depth: int
    ) -> list[PushPlan] | None:
        """Return pushes that connect the robot's region to the goal's, None if none do.

        SelectConnect of the paper: the doors in the order of the heuristic; of each the
        pushes in the order of their work; depth first, each obstacle moved once.
        """
        regions = self._regions(world.footprints)
        here = regions.of(world.position_m, _NEAR_M)
        goal = regions.of(self.task.goal_m, _NEAR_M)
        if here is None or goal is None:
            return None
        if here == goal:
            return []
        avoid: set[int] = set()
        while depth and (door := self._door(world, regions, here, goal, costs, avoid)):
            for push in self._openings(world, regions, here, door):
                moved = {i for i, _ in push.cascade.moved}
                left = {i: cost for i, cost in costs.items() if i not in moved}
                rest = self._select_connect(pushed(world, push), left, depth - 1)
                if rest is not None:
                    return [push, *rest]
            avoid.add(door.index)
        return None

    def _door(
        self,
        world: Observation,
        regions: Regions,
        here: int,
        goal: int,
        costs: Mapping[int, float],
        avoid: set[int],
    ) -> Door | None:
        """Return the next door that the heuristic proposes."""
        centroids = np.array([o.centroid_m for o in world.obstacles]).reshape(-1, 2)
        ends, points = (here, goal), (world.position_m, self.task.goal_m)
        usual = self.config.usual_push_m
        through = {i: cost * usual for i, cost in costs.items()}
        return nearest_door(regions, ends, points, centroids, through, avoid)

    def _openings(
        self, world: Observation, regions: Regions, here: int, door: Door
    ) -> Iterator[PushPlan]:
        """Yield the first push of a door that opens it, least work first, if any."""
        beyond = regions.parts[door.beyond]
        wanted = _OPEN_SHARE * float(shapely.area(beyond))
        for push in self._manipulations(world, regions, here, door):
            after = pushed(world, push)
            opened = self._regions(after.footprints)
            region = opened.of(after.position_m, _NEAR_M)
            if region is None:
                continue
            both = shapely.intersection(opened.parts[region], beyond)
            if float(shapely.area(both)) >= wanted:
                yield push
                return

    def _manipulations(
        self, world: Observation, regions: Regions, here: int, door: Door
    ) -> Sequence[PushPlan]:
        """Return the pushes of a door that can be begun, in the order of their work."""
        centroid = world.obstacles[door.index].centroid_m
        entry = regions.nearest_point(here, centroid)
        exit_m = regions.nearest_point(door.beyond, centroid)
        onward = (exit_m - entry) / max(norm(exit_m - entry), 1e-9)
        plans = [
            plan
            for extra in self.config.extra_m
            for plan in push_plans(
                world, self.task,
                Crossing(door.index, entry, exit_m + extra * onward),
                lambda i: self.force_n(world.obstacles[i]),
                lambda i: False,
                wide=True,
            )
            if regions.of(plan.approach_m, STANDOFF_M) == here
        ]  # fmt: skip
        return sorted(plans, key=lambda plan: self._work_m(world, plan))

    def _work_m(self, world: Observation, plan: PushPlan) -> float:
        """Return |x - x_push| + |u| + sum_i F_i d_i / kappa_d, in metres of driving."""
        forces = [
            self.force_n(world.obstacles[i]) * travel
            for i, travel in plan.cascade.moved
        ]
        driven = norm(plan.approach_m - world.position_m) + plan.travel_m
        return driven + math.fsum(forces) / self.task.motion_cost_jpm

    def _regions(self, footprints: Footprints) -> Regions:
        self._maps += 1
        clearance = self.task.radius_m + self.config.clearance_m
        return Regions(footprints, self.task.workspace_m, clearance)


def pushed(world: Observation, plan: PushPlan) -> Observation:
    """Return the map as a push is expected to leave it, with the robot behind it."""
    travel = dict(plan.cascade.moved)
    obstacles = tuple(
        _shifted(o, plan, travel[i]) if i in travel else o
        for i, o in enumerate(world.obstacles)
    )
    return replace(
        world,
        position_m=plan.end_m - STANDOFF_M * plan.direction,
        obstacles=obstacles,
        footprints=Footprints.stack([o.footprint for o in obstacles]),
    )


def _shifted(o: SensedObstacle, plan: PushPlan, travel_m: float) -> SensedObstacle:
    offset = travel_m * plan.direction
    return replace(
        o, footprint=o.footprint.shifted(offset), centroid_m=o.centroid_m + offset
    )


class Namo(ContactPlanner[NamoConfig]):
    """SelectConnect of Stilman and Kuffner (2005) on what is perceived.

    Free space falls into regions. While robot and goal are in one, it follows the
    shortest path and touches nothing. Else it looks for obstacles whose displacement
    connects the robot's region to the next on the way to the goal's, and for those that
    connect that one, until a whole plan is found; then it carries out the first push,
    and plans anew with what it has seen by then.

    What differs: the robot pushes and does not grasp; what is movable is what most
    likely is by class scores, and light enough, not what is known to be; unseen space
    is free; a push that failed twice is not tried again.
    """

    Policy = NamoPolicy
