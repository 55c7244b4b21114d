"""Knows everything about the world and has tried it all before: the upper bound."""

import heapq
import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array, Footprints, polyline_length
from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.oracle.push_routes import Way, gentle_touches, lines_through
from beacon_mj.planners.oracle.route_follower import (
    RouteDriver,
    RouteDriverConfig,
    way_past,
)
from beacon_mj.planners.oracle.truth import Oracle, Rollout, TrueObstacle, Truth
from beacon_mj.planners.push_through import PushThrough
from beacon_mj.planners.recovery import give_up

#: Speeds of pushing that are tried, as shares of the limit.
SPEED_SHARES = (1.0, 0.5, 0.2)


@dataclass(frozen=True, kw_only=True, slots=True)
class ClairvoyantConfig:
    """How long `Clairvoyant` searches."""

    #: Rehearsals after which it settles for the best one so far.
    rehearsals: int = 80
    #: Control steps that another rehearsal must be able to save.
    worthwhile_steps: float = 2.0

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        expect_between("rehearsals", self.rehearsals, 1, 10**6)
        expect_between("worthwhile_steps", self.worthwhile_steps, 0.0, 1000.0)


class Clairvoyant(Oracle[ClairvoyantConfig]):
    """Least time among the damage-free ways, found by branch and bound in the world.

    A node is a set P of obstacles that may be pushed; its way is the shortest path of
    the disc past all others. With fewer obstacles to push no path is shorter, so

        T(P) = (length of the shortest path past everything not in P) / v_max

    bounds the time of every way that pushes no more than P. After the way round (P
    empty) and the straight drive at the goal, which may slide along what it hits, the
    root is P = all that can be pushed without damage. Nodes are taken in order of
    T(P), and each is tried in a copy of the true world, with several lines and speeds;
    its children are P without one of the obstacles that its path leads through. The
    search ends when no node left can save a worthwhile number of steps, or with the
    last rehearsal allowed. The commands of the best clean rehearsal are then repeated:
    the world is deterministic, so they end as they did.

    The objective is time: the fewest control steps without damage, and of equal ones
    the shortest path. Energy is not minimised.
    """

    Config = ClairvoyantConfig
    _truth: Truth | None = None

    def set_truth(self, truth: Truth) -> None:
        """Take the truth about the next episode's world."""
        self._truth = truth

    def reset(self, task: Task) -> None:
        """Search, and remember the best way.

        Raises:
            PlannerError: If the truth was not told.
        """
        if self._truth is None:
            raise PlannerError(
                "Expected the clairvoyant to be told the truth before reset() but it "
                "was not: run it with run_episode(), which does."
            )
        search = _Search(self._truth, task, self.config)
        self.best = search.run()
        self.rehearsals = search.count

    def act(self, observation: Observation) -> Command:
        """Return the next command of the best rehearsal."""
        if self.best is None:
            return give_up(f"No clean way in {self.rehearsals} rehearsals.")
        if observation.step >= self.best.steps:
            return give_up("The world did not do what it did in the rehearsal.")
        info = PlannerInfo(
            action="follow",
            reason=f"The best of {self.rehearsals} rehearsals.",
            path_m=self.best.positions_m[observation.step :],
        )
        velocity = self.best.velocities_mps[observation.step]
        return Command(velocity_mps=velocity, info=info)


#: Bound [steps], order of discovery, what may be pushed, and the shortest path.
_Node = tuple[float, int, frozenset[str], Array]


class _Search:
    """Branch and bound over sets of obstacles that may be pushed."""

    def __init__(self, truth: Truth, task: Task, config: ClairvoyantConfig) -> None:
        self._truth, self._task, self._config = truth, task, config
        self._footprints = Footprints.stack([o.footprint for o in truth.obstacles])
        self._step_m = task.speed_mps * task.control_period_s
        self.best: Rollout | None = None
        self.count = 0

    def run(self) -> Rollout | None:
        """Return the best clean rehearsal, or None."""
        pushable = frozenset(
            o.id for o in self._truth.obstacles if o.pushable(self._task.force_max_n)
        )
        queue: list[_Node] = []
        seen: set[frozenset[str]] = set()
        self._push(queue, seen, frozenset())
        for bound, _, soft, path in queue:  # The way round, where there is one.
            self._try(bound, Way(path, soft, ()))
        queue.clear()
        self._rehearse(PushThrough())
        self._push(queue, seen, pushable)
        while queue:
            bound, _, soft, path = heapq.heappop(queue)
            if self._settled(bound):
                break
            through = self._crossed(path, soft)
            self._try(bound, Way(path, soft, tuple(through)))
            for obstacle in through:
                self._push(queue, seen, soft - {obstacle.id})
        return self.best

    def _push(
        self,
        queue: list[_Node],
        seen: set[frozenset[str]],
        soft: frozenset[str],
    ) -> None:
        if soft in seen:
            return
        seen.add(soft)
        keep = [i for i, o in enumerate(self._truth.obstacles) if o.id not in soft]
        hard = Footprints(
            self._footprints.vertices[keep], self._footprints.radius[keep]
        )
        path = way_past(hard, self._task.start_m, self._task.goal_m, self._task)
        if path is not None:
            bound = (polyline_length(path) - self._task.goal_tolerance_m) / self._step_m
            heapq.heappush(queue, (bound, len(seen), soft, path))

    def _settled(self, bound: float) -> bool:
        """Whether no way of at least `bound` steps is worth a rehearsal."""
        if self.count >= self._config.rehearsals:
            return True
        best = math.inf if self.best is None else self.best.steps
        return bound > best - self._config.worthwhile_steps

    def _crossed(self, path: Array, soft: frozenset[str]) -> list[TrueObstacle]:
        """Return the obstacles that a path leads through, in its order."""
        gaps = np.array(
            [self._footprints.segment_distance(a, b) for a, b in pairwise(path)]
        )
        inside = gaps < self._task.radius_m
        found = [
            (int(np.argmax(inside[:, i])), i)
            for i, o in enumerate(self._truth.obstacles)
            if o.id in soft and inside[:, i].any()
        ]
        return [self._truth.obstacles[i] for _, i in sorted(found)]

    def _try(self, bound: float, way: Way) -> None:
        """Rehearse one way, in the plainest manner first."""
        for config in self._manners(way):
            if self._settled(bound):
                return
            self._rehearse(RouteDriver(config))

    def _rehearse(self, planner: Planner) -> None:
        """Try a planner in the copy of the world, and keep the best clean run."""
        self.count += 1
        rollout = self._truth.rehearse(planner)
        if rollout.clean and (self.best is None or _key(rollout) < _key(self.best)):
            self.best = rollout

    def _manners(self, way: Way) -> Iterator[RouteDriverConfig]:
        """Yield lines and speeds in which to drive a way."""
        task = self._task
        for share in SPEED_SHARES if way.through else SPEED_SHARES[:1]:
            if share < 0.5 and self.best is not None:
                return  # Crawling saves no time; it is for want of another way.
            for line in lines_through(way, task):
                yield RouteDriverConfig(
                    soft=way.soft,
                    via_m=line,
                    touch_mps=gentle_touches(way, task, share),
                    push_mps=share * task.speed_mps,
                    max_steps=task.max_steps if self.best is None else self.best.steps,
                )


def _key(rollout: Rollout) -> tuple[int, float]:
    """Order rehearsals by time, then by length."""
    return rollout.steps, polyline_length(rollout.positions_m)
