"""Decisions on the route graph, carried out by the loop of the contact planners.

What is decided is the next door to try, and nothing else: planning of paths, pushes and
their speeds are those of every other planner that pushes, so differences between such
planners are differences between decisions.
"""

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass

from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array
from beacon_mj.interface import Observation, PushEvidence, SensedObstacle, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.numerics import norm
from beacon_mj.planners.base import C
from beacon_mj.planners.contact.belief_settings import BeliefSettings
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.contact.decision import Decision, Terms
from beacon_mj.planners.contact.limits import PushLimits, PushSettings, careful_limits
from beacon_mj.planners.contact.loop import ContactPlanner
from beacon_mj.planners.contact.policy import PushPolicy
from beacon_mj.planners.routes.graph import RouteGraph, RoutePlanner
from beacon_mj.planners.routes.progress import RouteProgress

#: A door that is pushed in vain was open if it went further than this [m].
OPENED_M = 0.1
#: Cost of a way through a door that has opened but still stands in the way [m/m].
_OPENED_COST = 20.0
#: The same of a door that nobody chose, where nothing else is left [m/m].
_OTHER_COST = 100.0


@dataclass(frozen=True, kw_only=True, slots=True)
class RouteConfig:
    """Parameters of a planner on the route graph: how it pushes."""

    #: How fast, and how carefully, it pushes.
    push: PushSettings = PushSettings()


class RoutePolicy(PushPolicy[C]):
    """Tries the doors that `rank` puts first.

    A door counts as open once a push has moved it, and as shut once one has failed. One
    that gave way, but still stands in the way, is pushed further.
    """

    _routes: RouteGraph | None = None

    def set_routes(self, routes: RouteGraph | None) -> None:
        """Take the next episode's route graph."""
        self._routes = routes

    def reset(self, task: Task) -> None:
        """Forget everything, and start before the first stage.

        Raises:
            PlannerError: If no graph was told.
        """
        self.start(task, {})

    def start(self, task: Task, learned: dict[str, bool]) -> None:
        """Start before the first stage, knowing which doors opened and which did not.

        Raises:
            PlannerError: If no graph was told.
        """
        if self._routes is None:
            raise PlannerError(
                "Expected a scene whose certificate holds the value of learning, such "
                "as those of lookalike-doors, revisited-rooms and unweighed-doors, but "
                "this one has no route graph."
            )
        super().reset(task)
        self.progress = RouteProgress(self._routes, learned)
        self._stood_m: dict[str, Array] = {}
        self._last_resort = False
        self._wanted: str | None = None
        self._terms: Terms = {}
        self._stale = True

    def next_day(self, task: Task) -> None:
        """Start on the next day, knowing of the doors what earlier days showed."""
        learned = self.progress.learned
        self.start(task, {k: v for k, v in learned.items() if k in self._lasting})

    @property
    def remembers(self) -> bool:
        """Whether what was learned is kept on the next day of a mission."""
        return True

    @property
    def belief_settings(self) -> BeliefSettings:
        """How beliefs are updated: as in the paper, and kept while latents last."""
        return BeliefSettings(overnight="belief" if self._lasting else "nothing")

    @property
    def _lasting(self) -> frozenset[str]:
        """Doors of today whose latent is that of earlier days, not drawn anew."""
        if self._routes is None or not self.remembers:
            return frozenset()
        refs = [ref for ref in self._routes.today if ref.stage > 0]
        return frozenset(name for r in refs for name in self._routes.doors[r.part])

    def observe(self, observation: Observation) -> None:
        """Note where every door stood at first."""
        super().observe(observation)
        for obstacle in observation.obstacles[len(self._stood_m) :]:
            self._stood_m[obstacle.id] = obstacle.centroid_m.copy()

    def learn(self, evidence: PushEvidence) -> bool:
        """Take in whether a door gave way; a decision is then due."""
        super().learn(evidence)
        if not any(evidence.id in ids for ids in self.progress.routes.doors):
            return False
        if evidence.evidence == "not_moved":
            self.progress.withstood(evidence.id)
        else:
            self.progress.opened(evidence.id)
        self._stale = True
        return True

    def ended(self, obstacle: SensedObstacle, *, failed: bool) -> None:
        """Count a door as shut that did not go anywhere."""
        went_m = norm(obstacle.centroid_m - self._stood_m[obstacle.id])
        if failed and went_m < OPENED_M:
            self.progress.withstood(obstacle.id)
            self._stale = True

    def crossing_cost(
        self, obstacle: SensedObstacle, *, last_resort: bool
    ) -> float | None:
        """Return nothing for doors that are chosen or still to come, None for walls."""
        self._last_resort = last_resort
        name = obstacle.id
        if not any(name in ids for ids in self.progress.routes.doors):
            return None
        known = self.progress.learned.get(name)
        if name == self._next() or (known is None and not self.progress.met(name)):
            return 0.0
        if known:
            return _OPENED_COST
        return _OTHER_COST if known is None and last_resort else None

    def choose(
        self,
        observation: Observation,
        options: Iterator[list[PushPlan]],
        detour: FreeRoute,
    ) -> Decision | None:
        """Choose the door that is wanted, or what stands in the way of it."""
        for plans in options:
            name = plans[0].id
            opened = self.progress.learned.get(name, False) and detour.path is None
            if name == self._next() or opened or self._last_resort:
                plan = min(plans, key=lambda p: self._drive_s(observation, p))
                return self._decided(plan, name)
        return None

    def limits(self, observation: Observation, plan: PushPlan) -> PushLimits:
        """Approach at the speed that the belief allows, as `beacon-voi` does."""
        obstacle = observation.obstacles[plan.index]
        fragility = self.beliefs.fragility(plan.moved(observation))
        return careful_limits(
            obstacle, self.force_n(obstacle), fragility, self.task, self.push
        )

    @property
    def push(self) -> PushSettings:
        """How fast, and how carefully, it pushes."""
        settings: PushSettings = self.config.push  # type: ignore[attr-defined]
        return settings

    @abstractmethod
    def rank(self, progress: RouteProgress) -> dict[int, float]:
        """Return what each door is expected to cost [s]; the least is tried next.

        Args:
            progress: Where the robot is, with `stage` not None, and what it knows.

        Returns:
            By place in the stage. Doors that failed there do not count.
        """

    def _next(self) -> str | None:
        """Return the door that is to be tried next; None if there is none."""
        if self._stale:
            self._stale, self._wanted, self._terms = False, None, {}
            progress = self.progress
            ranked = {} if progress.stage is None else self.rank(progress)
            left = {i: s for i, s in ranked.items() if i not in progress.failed}
            if left:
                best = min(left, key=lambda i: (left[i], i))
                self._wanted = progress.names[best]
                self._terms = {progress.names[i]: s for i, s in sorted(left.items())}
        return self._wanted

    def _drive_s(self, observation: Observation, plan: PushPlan) -> float:
        """Return the time of a push, and of the drive to the goal as the crow flies."""
        onward = 1.2 * norm(self.task.goal_m - plan.end_m) + plan.travel_m
        lead = plan.lead_s(observation.position_m, self.task)
        return lead + onward / self.task.speed_mps

    def _decided(self, plan: PushPlan, name: str) -> Decision:
        if name == self._wanted:
            reason = "The best door to try next."
        elif self.progress.learned.get(name):
            reason = "It gave way, and still stands in the way."
        else:
            reason = "Nothing else is left."
        cost = self._terms.get(name, 0.0)
        return Decision(plan, cost, float("inf"), self._terms, reason)


class RouteContactPlanner(ContactPlanner[C], RoutePlanner[C]):
    """A planner on the route graph that has the loop of the contact planners."""

    policy: RoutePolicy[C]

    def set_routes(self, routes: RouteGraph | None) -> None:
        """Take the next episode's route graph."""
        self.policy.set_routes(routes)
