"""The execution loop that all contact-aware planners share (paper II.I).

A planner advances along the way round. Where the way through meets an obstacle that
may be pushed, its policy compares pushing with going round; the loop carries out what
was chosen, and hands on what the bumper felt.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, ClassVar, final

from beacon_mj.interface import Action, Command, Observation, PlannerInfo, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.motion.expansions import ExpansionCount
from beacon_mj.planners.base import C, Planner
from beacon_mj.planners.contact.candidates import PushPlan, push_plans
from beacon_mj.planners.contact.checks import next_in_chain, stands_free, way_is_clear
from beacon_mj.planners.contact.controller import PushController
from beacon_mj.planners.contact.cost_map import ContactMap, Crossing
from beacon_mj.planners.contact.decision import Decision, compared
from beacon_mj.planners.contact.limits import position_error_m
from beacon_mj.planners.contact.memory import Memory
from beacon_mj.planners.contact.policy import PushPolicy
from beacon_mj.planners.recovery import Recovery, give_up

_CELL_M = 0.05  #: Grid of the way through, and of the way round [m].
_MARGIN_M = 0.01  #: Least room kept on the way round [m].
_TIGHT_CELL_M = 0.025  #: Grid of the way round where there is no other way [m].
_TIGHT_MARGIN_M = 0.005  #: Room kept there [m].
_FIRST_M = 0.03  #: Least travel of a push before it may end because the way is clear.


class ContactPlanner(Planner[C]):
    """The loop of the planners that may touch things on purpose.

    It is final: what a planner decides for itself stands in its policy, and a subclass
    only names that. Its parameters are the policy's.

    Attributes:
        Policy: The class of the policy.
        policy: This planner's policy.
    """

    Policy: ClassVar[type[PushPolicy[Any]]]

    def __init_subclass__(cls) -> None:
        """Take over the configuration of the policy."""
        super().__init_subclass__()
        if hasattr(cls, "Policy"):
            cls.Config = cls.Policy.Config

    def __init__(self, config: C | None = None) -> None:
        """Build the planner and its policy; None for defaults."""
        super().__init__(config)
        self.policy = self.Policy(self.config)
        self._memory = Memory(self.policy)

    @classmethod
    def missing(cls) -> list[str]:
        """Return what the planner, or its policy, still has to define."""
        if not hasattr(cls, "Policy"):
            return ["Policy"]
        return [f"Policy.{name}" for name in sorted(cls.Policy.__abstractmethods__)]

    @final
    def reset(self, task: Task) -> None:
        """Forget everything."""
        self._memory.reset(task)
        self._begin(task)

    @final
    def next_day(self, task: Task) -> None:
        """Forget all places, and keep what `belief.overnight` says."""
        self._memory.next_day(task)
        self._begin(task)

    def _begin(self, task: Task) -> None:
        """Start to plan and drive, with nothing seen."""
        radius_m = self.policy.planning_radius_m(task)
        checked = replace(task, radius_m=radius_m)
        self._task = task
        margin_m = max(_MARGIN_M, position_error_m(task.sensor))
        self._wide = FreeRoute(checked, _CELL_M, margin_m)
        self._tight = FreeRoute(checked, _TIGHT_CELL_M, _TIGHT_MARGIN_M)
        self._free = self._wide
        self._map = ContactMap(task, _CELL_M, radius_m + _TIGHT_MARGIN_M)
        self._count = ExpansionCount(self._wide, self._tight, self._map, self.policy)
        self._recovery = Recovery(task)
        self._controller: PushController | None = None
        self._decision: Decision | None = None
        self._planned_version = -1
        self._stale = True

    @final
    def act(self, observation: Observation) -> Command:
        """One pass of the execution loop."""
        self._learn(observation)
        command = self._carry_out(observation)
        if command is None:
            command = self._recovery.command(observation)
        if command is None:
            command = self._advance(observation)
        return self._count.charge(self._explained(command))

    def _learn(self, observation: Observation) -> None:
        """Hand on what is seen, and the evidence of push attempts."""
        if self._memory.learn(observation):
            self._stale = True
        if self._controller is not None:
            for evidence in observation.evidence:
                self._controller.learn(evidence)

    def _carry_out(self, observation: Observation) -> Command | None:
        """Go on with a push; None if there is none, or it is over."""
        controller = self._controller
        if controller is None:
            return None
        if spoilt := self._spoilt(controller, observation):
            controller.stop(spoilt)
        velocity = controller.act(observation)
        name = controller.plan.id
        if not controller.ended:
            reason = controller.reason or self._reason
            info = PlannerInfo(action=controller.action, reason=reason, target=name)
            return Command(velocity_mps=velocity, info=info)
        failed = controller.phase == "failed"
        self._memory.attempts.ended(name, observation, failed=failed)
        if controller.pushed_m > 0.0:
            self.policy.pushed(controller.obstacle(observation), failed=failed)
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
            # A door that gave way, before another barrier: no way to the goal is free.
            if self._wide.path is None and controller.pushed_m >= plan.travel_m:
                return "pushed as far as planned"
            if self.policy.predicts_cascades and not self.policy.chain_is_safe(
                next_in_chain(observation, plan, self._task)
            ):
                return "it would break another"
        return None

    def _advance(self, observation: Observation) -> Command:
        """Choose anew if need be, then begin a push or go on along the way round."""
        if self._recovery.ended or observation.map_version != self._planned_version:
            self._stale = True
        if self._stale:
            self._plan(observation)
        if self._controller is not None:
            velocity = self._controller.act(observation)
            name = self._controller.plan.id
            info = PlannerInfo(action="approach", reason=self._reason, target=name)
        elif self._free.path is None:
            return give_up("No way round, and nothing that may be pushed.")
        else:
            velocity = self._free.velocity(observation)
            action: Action = "move" if self._decision is None else "detour"
            info = PlannerInfo(action=action, reason=self._reason)
        return Command(velocity_mps=velocity, info=info)

    def _plan(self, observation: Observation) -> None:
        """Plan both ways and decide; where all else fails, with less room.

        What was just pushed aside is pushed again only where nothing else is left, and
        what earlier days of a mission have shown is doubted only after that.
        """
        self._stale, self._planned_version = False, observation.map_version
        self._decision = None
        self._free = self._wide
        self._wide.update(observation, force=self._recovery.ended)
        if self._choose(observation) or self._wide.path is not None:
            return
        self._free = self._tight
        self._tight.update(observation, force=self._recovery.ended)
        if self._tight.path is not None:
            return
        if self._memory.attempts.any_rests(observation) and self._choose(
            observation, rested=True
        ):
            return
        if self._choose(observation, rested=True, last_resort=True):
            return
        if self._memory.doubt(observation):
            self._plan(observation)

    def _choose(
        self,
        observation: Observation,
        *,
        rested: bool = False,
        last_resort: bool = False,
    ) -> bool:
        """Let the policy decide; return whether there is now a way to go on.

        Args:
            observation: What is known now.
            rested: Whether what was pushed a moment ago may be pushed again.
            last_resort: Whether nothing else is left.
        """
        costs = self._costs(observation, rested=rested, last_resort=last_resort)
        options = self._options(observation, costs, wide=last_resort)
        decision = self.policy.choose(observation, options, self._free)
        if decision is None:
            return False
        self._decision = decision
        if decision.plan is not None:
            limits = self.policy.allowed_limits(observation, decision.plan)
            self._controller = PushController(decision.plan, self._task, limits)
        return decision.plan is not None or self._free.path is not None

    def _options(
        self, observation: Observation, costs: dict[int, float], *, wide: bool
    ) -> Iterator[list[PushPlan]]:
        """Yield the pushes of each obstacle that the way through meets first.

        After each, that obstacle blocks the way, and the next best way is planned.
        """
        while costs:
            self._map.plan(observation, costs)
            if (crossing := self._map.crossing(observation, costs)) is None:
                return
            if plans := self._pushes(observation, crossing, wide=wide):
                yield plans
            del costs[crossing.index]

    def _costs(
        self, observation: Observation, *, rested: bool, last_resort: bool
    ) -> dict[int, float]:
        """Return the crossing costs of all obstacles that may be pushed now."""
        costs = {}
        for i, obstacle in enumerate(observation.obstacles):
            if self._memory.attempts.immovable(obstacle):
                continue
            if self._memory.attempts.rests(obstacle, observation) and not rested:
                continue
            cost = self.policy.crossing_cost(obstacle, last_resort=last_resort)
            if cost is not None:
                costs[i] = cost
        return costs

    def _pushes(
        self, observation: Observation, crossing: Crossing, *, wide: bool
    ) -> list[PushPlan]:
        """Return the feasible pushes of the crossed obstacle."""
        obstacles, limit_n = observation.obstacles, self._task.force_max_n
        return push_plans(
            observation,
            self._task,
            crossing,
            lambda i: min(self.policy.force_n(obstacles[i]), limit_n),
            lambda i: self._memory.attempts.immovable(obstacles[i]),
            predict=self.policy.predicts_cascades,
            wide=wide,
        )

    @property
    def _reason(self) -> str:
        """Why the robot does what it does."""
        return self._decision.reason if self._decision else "The way is free."

    def _explained(self, command: Command) -> Command:
        """Return a command with what was compared, planned and believed."""
        info = replace(
            command.info,
            **compared(self._decision),
            path_m=self._free.left() if self._controller is None else None,
            beliefs=self.policy.beliefs.of_seen,
            replanned=self._free.replanned,
        )
        self._free.replanned = False
        return Command(
            velocity_mps=command.velocity_mps, give_up=command.give_up, info=info
        )
