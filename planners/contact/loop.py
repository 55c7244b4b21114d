"""The execution loop that all contact-aware planners share (paper II.I).

A planner advances along the way round; where the way through meets an obstacle that
may be pushed, it compares pushing with going round, carries out what it chose, and
learns from what happened. Subclasses say what may be pushed and what it costs.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

from beacon_mj.geometry import Array
from beacon_mj.interface import Action, Command, Observation, PlannerInfo, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.planners.contact.candidates import PushPlan, push_plans
from beacon_mj.planners.contact.checks import next_in_chain, stands_free, way_is_clear
from beacon_mj.planners.contact.controller import PushController
from beacon_mj.planners.contact.cost_map import ContactMap, Crossing
from beacon_mj.planners.contact.decision import Decision
from beacon_mj.planners.contact.policy import PushPolicy
from beacon_mj.planners.recovery import Recovery, give_up

_CELL_M = 0.05  #: Grid of the way through, and of the way round [m].
_MARGIN_M = 0.01  #: Room kept on the way round [m].
_TIGHT_CELL_M = 0.025  #: Grid of the way round where there is no other way [m].
_TIGHT_MARGIN_M = 0.005  #: Room kept there [m].
_COOLDOWN_S = 3.0  #: Time for which an obstacle just pushed aside is left alone [s].
MOST_OPTIONS = 3  #: Obstacles whose pushes are compared in one decision.
_FIRST_M = 0.03  #: Least travel of a push before it may end because the way is clear.
_MAX_FAILURES = 2  #: Failed pushes of one obstacle before it counts as immovable.


class ContactPlanner(PushPolicy):
    """Base of the planners that may touch things on purpose."""

    def reset(self, task: Task) -> None:
        """Forget everything."""
        self._task = task
        self.beliefs = self._new_beliefs()
        radius_m = self.planning_radius_m(task)
        checked = replace(task, radius_m=radius_m)
        self._wide = FreeRoute(checked, _CELL_M, _MARGIN_M)
        self._tight = FreeRoute(checked, _TIGHT_CELL_M, _TIGHT_MARGIN_M)
        self._free = self._wide
        self._map = ContactMap(task, _CELL_M, radius_m + _TIGHT_MARGIN_M)
        self._recovery = Recovery(task)
        self._controller: PushController | None = None
        self._decision: Decision | None = None
        self._failures: dict[str, int] = {}
        self._broken: set[str] = set()
        self._cooldown: dict[str, float] = {}
        self._planned_version = -1
        self._stale = True

    def act(self, observation: Observation) -> Command:
        """One pass of the execution loop."""
        self._learn(observation)
        if self._controller is not None:
            command = self._carry_out(self._controller, observation)
            if command is not None:
                return command
        away = self._recovery.velocity(observation)
        if self._recovery.exhausted:
            return give_up(f"Got stuck {self._recovery.stalls} times.")
        if away is not None:
            return self._command(
                away, "back_off", "No progress: away from what is near."
            )
        if self._recovery.ended or observation.map_version != self._planned_version:
            self._stale = True
        if self._stale:
            self._choose(observation)
        return self._proceed(observation)

    def _learn(self, observation: Observation) -> None:
        """Take in new obstacles and the evidence of push attempts."""
        for obstacle in observation.obstacles[len(self.beliefs.beliefs) :]:
            self.beliefs.sight(obstacle)
        self._broken = {o.id for o in observation.obstacles if o.broken}
        for evidence in observation.evidence:
            change = self.beliefs.learn(evidence)
            if self.belief_changed(change):
                self._stale = True
            if evidence.evidence == "not_moved":
                self._failures[evidence.id] = _MAX_FAILURES
                controller = self._controller
                if controller is not None and controller.plan.id == evidence.id:
                    controller.abort("it did not move")

    def _carry_out(
        self, controller: PushController, observation: Observation
    ) -> Command | None:
        """Go on with a push; None when it is over."""
        name = controller.plan.id
        if spoilt := self._spoilt(controller, observation):
            begun = controller.phase == "push"
            controller.phase = "done" if begun else "failed"
            controller.reason = spoilt
        velocity = controller.act(observation)
        if controller.phase not in ("done", "failed"):
            action: Action = "push" if controller.phase == "push" else "approach"
            if controller.phase == "back_off":
                action = "back_off"
            reason = controller.reason or self._reason
            return self._command(velocity, action, reason, name)
        if controller.phase == "failed":
            self._failures[name] = self._failures.get(name, 0) + 1
        self._cooldown[name] = observation.time_s + _COOLDOWN_S
        self._controller, self._stale = None, True
        self._recovery.restart(observation)
        return None

    def _spoilt(
        self, controller: PushController, observation: Observation
    ) -> str | None:
        """Return why a push that goes on should not, None if it may."""
        plan = controller.plan
        if controller.phase == "approach":
            if observation.map_version != self._planned_version:
                self._planned_version = observation.map_version
                if not stands_free(observation, plan, self._task):
                    return "something stands where the push was to begin"
        elif controller.phase == "push":
            if controller.pushed_m >= _FIRST_M and way_is_clear(
                observation, plan, self._wide, self._task
            ):
                return "the way is clear"
            if self.predicts_cascades and not self.chain_is_safe(
                next_in_chain(observation, plan, self._task)
            ):
                return "it would break another"
        return None

    def _choose(self, observation: Observation) -> None:
        """Plan both ways and decide."""
        self._stale, self._planned_version = False, observation.map_version
        self._decision = None
        self._free = self._wide
        self._wide.update(observation, force=self._recovery.ended)
        if (
            self._consider(observation, last_resort=False)
            or self._wide.path is not None
        ):
            return
        self._free = self._tight
        self._tight.update(observation, force=self._recovery.ended)
        if self._tight.path is None:
            self._consider(observation, last_resort=True)

    def _consider(self, observation: Observation, *, last_resort: bool) -> bool:
        """Compare pushes on the ways through with the way round; False if none."""
        costs = self._costs(observation, last_resort=last_resort)
        options = self.options(observation, costs, wide=last_resort)
        while plans := [p for option in islice(options, MOST_OPTIONS) for p in option]:
            self._decision = self.compare(observation, plans, self._free)
            if self._decision.plan is not None:
                self._begin(self._decision.plan, observation)
            if self._decision.plan is not None or self._free.path is not None:
                return True
        return False

    def options(
        self, observation: Observation, costs: dict[int, float], *, wide: bool
    ) -> Iterator[list[PushPlan]]:
        """Yield the pushes of each obstacle that the way through meets first.

        After each, that obstacle blocks the way, and the next best way is planned.
        """
        costs = dict(costs)
        while costs:
            self._map.plan(observation, costs)
            crossing = self._map.crossing(observation, costs)
            if crossing is None:
                return
            if plans := self._plans(observation, crossing, wide=wide):
                yield plans
            del costs[crossing.index]

    def _costs(
        self, observation: Observation, *, last_resort: bool
    ) -> dict[int, float]:
        """Return the cell costs of all obstacles that may be pushed now."""
        costs = {}
        for i, obstacle in enumerate(observation.obstacles):
            if self._failures.get(obstacle.id, 0) >= _MAX_FAILURES:
                continue
            cooling = self._cooldown.get(obstacle.id, -1.0) > observation.time_s
            if cooling and self._free.path is not None:
                continue
            cost = self.push_cost(observation, i)
            if cost is None and last_resort:
                cost = self.last_resort_cost(observation, i)
            if cost is not None:
                costs[i] = cost
        return costs

    def _plans(
        self, observation: Observation, crossing: Crossing, *, wide: bool
    ) -> list[PushPlan]:
        obstacles = observation.obstacles

        def fixed(i: int) -> bool:
            return self._failures.get(obstacles[i].id, 0) >= _MAX_FAILURES

        return push_plans(
            observation,
            self._task,
            crossing,
            lambda i: min(self.beliefs.force_n(obstacles[i]), self._task.force_max_n),
            fixed,
            predict=self.predicts_cascades,
            wide=wide,
        )

    def _begin(self, plan: PushPlan, observation: Observation) -> None:
        """Begin a push."""
        limits = self.limits(observation, plan)
        self._controller = PushController(plan, self._task, limits)

    def _proceed(self, observation: Observation) -> Command:
        """Begin what was chosen, or go on along the way round."""
        if self._controller is not None:
            velocity = self._controller.act(observation)
            name = self._controller.plan.id
            return self._command(velocity, "approach", self._reason, name)
        if self._free.path is None:
            return give_up("No way round, and nothing that may be pushed.")
        velocity = self._free.velocity(observation)
        detour = self._decision is not None
        return self._command(velocity, "detour" if detour else "move", self._reason)

    @property
    def _reason(self) -> str:
        """Why the robot does what it does."""
        return self._decision.reason if self._decision else "The way is free."

    def _command(
        self, velocity: Array, action: Action, reason: str, target: str | None = None
    ) -> Command:
        decision = self._decision
        info = PlannerInfo(
            action=action,
            reason=reason,
            target=target,
            cost_push=None if decision is None else decision.cost_push,
            cost_detour=None if decision is None else decision.cost_detour,
            terms={} if decision is None else decision.terms,
            path_m=self._free.left() if self._controller is None else None,
            beliefs=self.beliefs.beliefs,
            replanned=self._free.replanned,
            expansions=self._free.expansions + self._map.expansions,
        )
        self._free.replanned, self._free.expansions, self._map.expansions = False, 0, 0
        return Command(velocity_mps=velocity, info=info)
