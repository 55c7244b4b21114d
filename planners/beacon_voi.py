"""BEACON-VOI, our own: expected route costs, and the value of a probing touch."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

from beacon_mj.interface import Observation, SensedObstacle, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.numerics import norm
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.contact.belief_settings import BeliefSettings
from beacon_mj.planners.contact.candidates import PushPlan, segment_is_clear
from beacon_mj.planners.contact.cost_to_go import TravelTimes
from beacon_mj.planners.contact.decision import MOST_OPTIONS, Decision
from beacon_mj.planners.contact.limits import (
    PushLimits,
    PushSettings,
    careful_limits,
    mass_error,
)
from beacon_mj.planners.contact.loop import ContactPlanner
from beacon_mj.planners.contact.policy import PushPolicy

_CUT_OFF_S = 60.0  #: What it counts for if nothing is left after a failed push [s].
_BREAKS = 0.02  #: Probability that a gentle push breaks something fragile, at least.
_BREAKS_DOUBTED = 0.1  #: The same where a mass is wrong by its own size.
_PREMIUM = 0.3  #: Extra cost of ways through space that was never in range [m/m].
_PREMIUM_HIDDEN = 1.0  #: The same where obstacles hide others.
_ROOM_M = 0.001  #: Room beside the disc within which a straight drive is clear [m].
_Scored = tuple[float, PushPlan]  #: Expected time of a push [s].


@dataclass(frozen=True, kw_only=True, slots=True)
class BeaconVoiConfig:
    """Parameters of `BeaconVoi`."""

    #: Standard deviation of the logarithm of one obstacle's perceived breakaway force;
    #: None for what the sensor's data sheet says.
    force_error: float | None = None
    #: Time that a push which fails costs, touch and retreat included [s].
    failure_s: float = 3.0
    #: Time that a joule of pushing is worth, over that of a joule of driving.
    energy_weight: float = 0.3
    #: Cost of breaking something [s].
    damage_s: float = 60.0
    #: Probability that a gentle push breaks something fragile; None for 0.02, and more
    #: where the sensor's data sheet says that masses are badly perceived.
    break_probability: float | None = None
    #: The same for a fragile obstacle in a chain reaction, pushed or reached.
    chain_break_probability: float = 0.3
    #: Probability of being fragile above which no chain reaction may reach it.
    accepted_fragile_chain: float = 0.1
    #: Extra cost of ways through space that was never in range [m/m]; None for 0.3, or
    #: for 1.0 where obstacles hide others.
    unknown_premium: float | None = None
    #: Least probability of giving way at which a push is considered.
    least_chance: float = 0.08
    #: How fast, and how carefully, it pushes.
    push: PushSettings = PushSettings()
    #: What it learns from pushes; any change of a belief counts.
    belief: BeliefSettings = BeliefSettings(
        threshold=0.0, sharing=frozenset({"kind", "scale"})
    )

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        for name in ("failure_s", "energy_weight", "damage_s"):
            expect_between(name, getattr(self, name), 0.0, 1000.0)
        for name in ("chain_break_probability", "accepted_fragile_chain"):
            expect_between(name, getattr(self, name), 0.0, 1.0)
        expect_between("least_chance", self.least_chance, 0.001, 1.0)
        for name, low, high in (
            ("force_error", 0.001, 3.0),
            ("break_probability", 0.0, 1.0),
            ("unknown_premium", 0.0, 1000.0),
        ):
            if (value := getattr(self, name)) is not None:
                expect_between(name, value, low, high)


class BeaconVoiPolicy(PushPolicy[BeaconVoiConfig]):
    """Push where the least expected time Q_i is below the time round."""

    Config = BeaconVoiConfig

    def reset(self, task: Task) -> None:
        """Forget everything."""
        super().reset(task)
        self._breaks = self._break_probability()
        self._times = TravelTimes(task, self._unknown_premium())

    def observe(self, observation: Observation) -> None:
        """Note new obstacles, and what came into range."""
        super().observe(observation)
        self._times.note_range(observation.position_m)

    def crossing_cost(
        self, obstacle: SensedObstacle, *, last_resort: bool
    ) -> float | None:
        """Return the expected cost per metre of the way, failures included [m/m]."""
        cfg, task = self.config, self.task
        chance = self.chance(obstacle)
        if chance < cfg.least_chance:
            if not last_resort:
                return None
            chance = cfg.least_chance
        energy = cfg.energy_weight * self.force_n(obstacle)
        failing_m = (1.0 - chance) / chance * cfg.failure_s * task.speed_mps
        chord_m = 2.0 * task.radius_m + math.sqrt(
            obstacle.volume_m3 / obstacle.height_m
        )
        return energy / task.motion_cost_jpm + failing_m / chord_m

    def choose(
        self,
        observation: Observation,
        options: Iterator[list[PushPlan]],
        detour: FreeRoute,
    ) -> Decision | None:
        """Choose the least expected time among all pushes and the way round."""
        few = list(islice(options, MOST_OPTIONS))
        if not few:
            return None
        self._times.update(observation, self._costs(observation))
        alone = [
            _quickest((self._expected_s(observation, p, self._round_s(p)), p)
                      for p in plans)
            for plans in few
        ]  # fmt: skip
        expected_s, plan = _quickest(
            (
                self._expected_s(
                    observation, p, self._fallback_s(observation, p, alone)
                ),
                p,
            )
            for _, p in alone
        )
        # Travel times alone do not tell: they keep less room than a path.
        round_s = math.inf
        if detour.path is not None:
            round_s = self._times.from_point(observation.position_m)
        return _decided(expected_s, round_s, plan)

    def limits(self, observation: Observation, plan: PushPlan) -> PushLimits:
        """Approach at the speed that the belief allows."""
        obstacle = observation.obstacles[plan.index]
        fragility = self.beliefs.fragility(plan.moved(observation))
        return careful_limits(
            obstacle, self.force_n(obstacle), fragility, self.task, self.config.push
        )

    def chain_is_safe(self, moved: Sequence[SensedObstacle]) -> bool:
        """Whether no likely-fragile obstacle is in a chain reaction (paper II.G)."""
        return self.beliefs.chain_is_safe(moved, self.config.accepted_fragile_chain)

    @property
    def belief_settings(self) -> BeliefSettings:
        """How beliefs are updated."""
        return self.config.belief

    @property
    def force_error(self) -> float:
        """Standard deviation of the logarithm of a perceived breakaway force."""
        own = self.config.force_error
        return super().force_error if own is None else own

    @property
    def expansions(self) -> int:
        """Vertices expanded for the travel times."""
        return self._times.expansions

    def chance(self, obstacle: SensedObstacle) -> float:
        """Return p_i, the probability that an obstacle gives way to a full push."""
        gives_way = 1.0 - self.beliefs.probability(obstacle.id, "safe")
        if obstacle.id in self.beliefs.at_most_n:
            return gives_way
        return gives_way * self.beliefs.probability_below(
            obstacle, self.task.force_max_n
        )

    def _expected_s(
        self, observation: Observation, plan: PushPlan, without_s: float
    ) -> float:
        """Return Q_i with V_without_i given [s]."""
        cfg, task = self.config, self.task
        limits = self.allowed_limits(observation, plan)
        chance = math.prod(self.chance(o) for o in plan.moved(observation))
        touch_s = self._lead_s(observation, plan)
        push_s = plan.travel_m / limits.push_mps + self._worth_s(observation, plan)
        beyond_s = self._times.from_point(plan.end_m)
        if not math.isfinite(beyond_s):  # Another barrier stands before the goal.
            beyond_s = self._times.through(plan.end_m)
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
        cfg, task = self.config, self.task
        joule_s = 1.0 / (task.motion_cost_jpm * task.speed_mps)
        worth = 0.0
        alone = len(plan.cascade.moved) == 1
        breaks = self._breaks if alone else cfg.chain_break_probability
        for i, travel in plan.cascade.moved:
            obstacle = observation.obstacles[i]
            fragile = self.beliefs.probability(obstacle.id, "fragile")
            worth += cfg.damage_s * breaks * fragile
            worth += cfg.energy_weight * joule_s * travel * self.force_n(obstacle)
        return worth

    def _break_probability(self) -> float:
        """Return the probability that a gentle push breaks something fragile."""
        if self.config.break_probability is not None:
            return self.config.break_probability
        return min(max(_BREAKS, _BREAKS_DOUBTED * mass_error(self.task.sensor)), 1.0)

    def _unknown_premium(self) -> float:
        """Return the extra cost of ways through unknown space [m/m]."""
        if self.config.unknown_premium is not None:
            return self.config.unknown_premium
        return _PREMIUM_HIDDEN if self.task.sensor.occlusion else _PREMIUM

    def _round_s(self, plan: PushPlan) -> float:
        """Return the time round from where a push of `plan` would fail [s]."""
        return self._times.from_point(plan.approach_m)

    def _costs(self, observation: Observation) -> dict[int, float]:
        """Return the crossing cost of all that may be pushed, by index [m/m]."""
        costs = {
            i: self.crossing_cost(obstacle, last_resort=False)
            for i, obstacle in enumerate(observation.obstacles)
        }
        return {i: cost for i, cost in costs.items() if cost is not None}

    def _lead_s(self, observation: Observation, plan: PushPlan) -> float:
        """Return the time until a push touches, past what stands in between [s]."""
        task, here = self.task, observation.position_m
        direct_s = plan.lead_s(here, task)
        room_m = task.radius_m + _ROOM_M
        if segment_is_clear(observation.footprints, here, plan.approach_m, room_m):
            return direct_s
        way_s = self._times.to_point(plan.approach_m)
        if not math.isfinite(way_s):
            return direct_s
        return max(
            direct_s, direct_s + way_s - norm(plan.approach_m - here) / task.speed_mps
        )

    def _fallback_s(
        self, observation: Observation, plan: PushPlan, alone: list[_Scored]
    ) -> float:
        """Return the best that is left if `plan` fails: the way round, another push."""
        best = self._round_s(plan)
        for expected_s, other in alone:
            if other.index != plan.index:
                over = norm(other.approach_m - plan.approach_m)
                led_s = self._lead_s(observation, other)
                best = min(best, expected_s - led_s + over / self.task.speed_mps)
        return best


def _quickest(scored: Iterable[_Scored]) -> _Scored:
    """Return the push with the least expected time, the first of equal ones."""
    return min(scored, key=lambda each: each[0])


def _decided(expected_s: float, round_s: float, plan: PushPlan) -> Decision:
    """Return the decision between the best push and the way round."""
    terms = {"expected_s": expected_s, "round_s": round_s}
    if expected_s < round_s:
        reason = f"Push: {expected_s:.1f} s expected, {round_s:.1f} s round."
        return Decision(plan, expected_s, round_s, terms, reason)
    reason = f"Go round: {round_s:.1f} s, {expected_s:.1f} s expected to push."
    return Decision(None, expected_s, round_s, terms, reason)


class BeaconVoi(ContactPlanner[BeaconVoiConfig]):
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

    Policy = BeaconVoiPolicy
