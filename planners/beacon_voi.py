"""BEACON-VOI, our own: expected route costs, and the value of a probing touch."""

import math
from dataclasses import dataclass
from itertools import islice
from typing import ClassVar

from beacon_mj.interface import Command, Observation, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.numerics import norm
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.contact.belief import BeliefMap, Likelihoods
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.contact.cost_to_go import TravelTimes
from beacon_mj.planners.contact.decision import Decision
from beacon_mj.planners.contact.limits import PushLimits, careful_limits
from beacon_mj.planners.contact.loop import MOST_OPTIONS, ContactPlanner

_CUT_OFF_S = 60.0  #: What it counts for if nothing is left after a failed push [s].


@dataclass(frozen=True, kw_only=True, slots=True)
class BeaconVoiConfig:
    """Parameters of `BeaconVoi`."""

    #: Standard deviation of the logarithm of the perceived breakaway force.
    force_error: float = 0.21
    #: Time that a push which fails costs, touch and retreat included [s].
    failure_s: float = 3.0
    #: Time that a joule of pushing is worth, over that of a joule of driving.
    energy_weight: float = 0.3
    #: Cost of breaking something [s].
    damage_s: float = 60.0
    #: Probability that a gentle push breaks something fragile.
    break_probability: float = 0.02
    #: The same for a fragile obstacle in a chain reaction, pushed or reached.
    chain_break_probability: float = 0.3
    #: Probability of being fragile above which no chain reaction may reach it.
    accepted_fragile_chain: float = 0.1
    #: Extra cost of ways through space that was never in range [m/m].
    unknown_premium: float = 0.3
    #: Least probability of giving way at which a push is considered.
    least_chance: float = 0.08
    #: Touching force that is allowed where something may break [N].
    gentle_force_n: float = 10.0
    #: Bumper force above which a push of something that may break slows down [N].
    fragile_force_n: float = 14.0
    #: Speed of a push [m/s].
    push_speed_mps: float = 0.5

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        for name in ("failure_s", "energy_weight", "damage_s", "unknown_premium"):
            expect_between(name, getattr(self, name), 0.0, 1000.0)
        for name in (
            "break_probability",
            "chain_break_probability",
            "accepted_fragile_chain",
            "least_chance",
        ):
            expect_between(name, getattr(self, name), 0.0, 1.0)
        expect_between("force_error", self.force_error, 0.001, 3.0)
        expect_between("gentle_force_n", self.gentle_force_n, 0.1, 1000.0)
        expect_between("fragile_force_n", self.fragile_force_n, 0.1, 1000.0)
        expect_between("push_speed_mps", self.push_speed_mps, 0.01, 5.0)


class BeaconVoi(ContactPlanner):
    """Least expected time under the belief, with the value of what a touch reveals.

    For each obstacle i that a way through meets, with p_i the probability that it
    gives way,

        Q_i = t_i + p_i (t_push + V_beyond) + (1 - p_i) (t_fail + V_without_i),

    where t_i is the time to touch it, V_beyond the time from behind it to the goal and
    V_without_i the best that is left if it turns out not to give way: another push or
    the way round. A touch is worth its time when the least Q_i is below the time of
    the way round. p_i combines the class with a belief over the breakaway force,
    log-normal about the perceived one. Energy and expected damage count as time.
    """

    Config: ClassVar[type[BeaconVoiConfig]] = BeaconVoiConfig
    config: BeaconVoiConfig

    def _new_beliefs(self) -> BeliefMap:
        return BeliefMap(Likelihoods())

    def reset(self, task: Task) -> None:
        """Forget everything."""
        super().reset(task)
        self._times = TravelTimes(task, self.config.unknown_premium)

    def act(self, observation: Observation) -> Command:
        """Note what came into range, then act."""
        self._times.note_range(observation.position_m)
        return super().act(observation)

    @property
    def accepted_fragile_chain(self) -> float:
        """Probability of being fragile up to which a chain reaction may reach it."""
        return self.config.accepted_fragile_chain

    def chance(self, observation: Observation, index: int) -> float:
        """Return p_i, the probability that an obstacle gives way to a full push."""
        obstacle = observation.obstacles[index]
        gives_way = 1.0 - self.beliefs.probability(obstacle.id, "safe")
        if obstacle.id in self.beliefs.at_most_n:
            return gives_way
        spare = math.log(self._task.force_max_n / max(obstacle.perceived_force_n, 1e-6))
        scale = self.config.force_error * math.sqrt(2.0)
        return gives_way * 0.5 * math.erfc(-spare / scale)

    def push_cost(self, observation: Observation, index: int) -> float | None:
        """Return the expected cost of crossing an obstacle, per metre of the way."""
        chance = self.chance(observation, index)
        if chance < self.config.least_chance:
            return None
        return self._crossing_cost(observation, index, chance)

    def last_resort_cost(self, observation: Observation, index: int) -> float | None:
        """Return a cost for what most likely will not give way."""
        return self._crossing_cost(observation, index, self.config.least_chance)

    def _consider(self, observation: Observation, *, last_resort: bool) -> bool:
        """Choose the least expected time among all pushes and the way round."""
        costs = self._costs(observation, last_resort=last_resort)
        options = list(
            islice(self.options(observation, costs, wide=last_resort), MOST_OPTIONS)
        )
        if not options:
            return False
        self._times.update(observation)
        here = self._way_round_s(observation)
        alone = [
            min(
                ((self._expected_s(observation, p, self._round(p)), p) for p in plans),
                key=lambda scored: scored[0],
            )
            for plans in options
        ]
        scored = [
            (self._expected_s(observation, plan, self._fallback(plan, alone)), plan)
            for _, plan in alone
        ]
        expected_s, plan = min(scored, key=lambda s: s[0])
        self._decision = self._decided(expected_s, here, plan)
        if self._decision.plan is not None:
            self._begin(plan, observation)
        return self._decision.plan is not None or self._free.path is not None

    def compare(
        self, observation: Observation, plans: list[PushPlan], detour: FreeRoute
    ) -> Decision:
        """Return the decision between one obstacle's pushes and the way round."""
        self._times.update(observation)
        expected_s, plan = min(
            ((self._expected_s(observation, p, self._round(p)), p) for p in plans),
            key=lambda scored: scored[0],
        )
        here = self._way_round_s(observation)
        return self._decided(expected_s, here, plan)

    def limits(self, observation: Observation, plan: PushPlan) -> PushLimits:
        """Approach at the speed that the belief allows."""
        obstacle = observation.obstacles[plan.index]
        need_n = self.beliefs.force_n(obstacle)
        fragility = self.fragility(observation, plan)
        return careful_limits(obstacle, need_n, fragility, self._task, self.config)

    def _decided(self, expected_s: float, round_s: float, plan: PushPlan) -> Decision:
        terms = {"expected_s": expected_s, "round_s": round_s}
        if expected_s < round_s:
            reason = f"Push: {expected_s:.1f} s expected, {round_s:.1f} s round."
            return Decision(plan, expected_s, round_s, terms, reason)
        reason = f"Go round: {round_s:.1f} s, {expected_s:.1f} s expected to push."
        return Decision(None, expected_s, round_s, terms, reason)

    def _expected_s(
        self, observation: Observation, plan: PushPlan, without_s: float
    ) -> float:
        """Return Q_i with V_without_i given [s]."""
        cfg, task = self.config, self._task
        limits = self.limits(observation, plan)
        chance = math.prod(self.chance(observation, i) for i, _ in plan.cascade.moved)
        touch_s = plan.lead_s(observation.position_m, task)
        push_s = plan.travel_m / limits.push_mps + self._worth_s(observation, plan)
        beyond_s = self._times.from_point(plan.end_m)
        if not math.isfinite(beyond_s):
            onward = norm(task.goal_m - plan.end_m)
            beyond_s = 1.2 * onward / task.speed_mps
        if not math.isfinite(without_s):
            without_s = _CUT_OFF_S
        return (
            touch_s
            + chance * (push_s + beyond_s)
            + (1.0 - chance) * (cfg.failure_s + without_s)
        )

    def _worth_s(self, observation: Observation, plan: PushPlan) -> float:
        """Return what energy and expected damage of a push are worth [s]."""
        cfg, task = self.config, self._task
        joule_s = 1.0 / (task.motion_cost_jpm * task.speed_mps)
        worth = 0.0
        alone = len(plan.cascade.moved) == 1
        breaks = cfg.break_probability if alone else cfg.chain_break_probability
        for i, travel in plan.cascade.moved:
            obstacle = observation.obstacles[i]
            fragile = self.beliefs.probability(obstacle.id, "fragile")
            worth += cfg.damage_s * breaks * fragile
            worth += (
                cfg.energy_weight * joule_s * travel * self.beliefs.force_n(obstacle)
            )
        return worth

    def _way_round_s(self, observation: Observation) -> float:
        """Return the time to the goal without touching, inf if no path was found [s].

        Travel times alone do not tell: they keep less room than a path.
        """
        if self._free.path is None:
            return math.inf
        return self._times.from_point(observation.position_m)

    def _round(self, plan: PushPlan) -> float:
        """Return the time round from where a push of `plan` would fail [s]."""
        return self._times.from_point(plan.approach_m)

    def _fallback(self, plan: PushPlan, alone: list[tuple[float, PushPlan]]) -> float:
        """Return the best that is left if `plan` fails: the way round, another push."""
        best = self._round(plan)
        for expected_s, other in alone:
            if other.index != plan.index:
                over = norm(other.approach_m - plan.approach_m)
                best = min(best, expected_s + over / self._task.speed_mps)
        return best

    def _crossing_cost(
        self, observation: Observation, index: int, chance: float
    ) -> float:
        """Return the cost of a crossing per metre, failures included [m/m]."""
        cfg, obstacle = self.config, observation.obstacles[index]
        energy = cfg.energy_weight * self.beliefs.force_n(obstacle)
        failing_m = (1.0 - chance) / chance * cfg.failure_s * self._task.speed_mps
        chord_m = 2.0 * self._task.radius_m + math.sqrt(
            obstacle.volume_m3 / obstacle.height_m
        )
        return energy / self._task.motion_cost_jpm + failing_m / chord_m
