"""BEACON: belief-aware replanning, the paper's method, whole."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from beacon_mj.interface import Observation, Probabilities, SensedObstacle, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.planners.checks import expect_all_between, expect_between
from beacon_mj.planners.contact.belief_settings import BeliefSettings
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.contact.decision import Decision, decide, decide_in_turn
from beacon_mj.planners.contact.limits import (
    PushLimits,
    PushSettings,
    careful_limits,
)
from beacon_mj.planners.contact.loop import ContactPlanner
from beacon_mj.planners.contact.objective import (
    Candidate,
    Weights,
    detour_candidate,
    objective,
    push_candidate,
)
from beacon_mj.planners.contact.policy import PushPolicy


@dataclass(frozen=True, kw_only=True, slots=True)
class BeaconConfig:
    """Parameters of BEACON; defaults of Table I where the paper has them."""

    #: Radius with which the planner checks collisions; 0 means the robot's own [m].
    robot_radius_m: float = 0.0
    #: Weight of occupancy in the cost map (lambda_occ).
    lambda_occ: float = 5.0
    #: Weight of semantic risk in the cost map (lambda_sem).
    lambda_sem: float = 2.5
    #: Bonus of pushing (b_push).
    push_bias: float = 0.35
    #: Margin in the comparison (m_detour); as printed, a larger one favours pushing.
    detour_margin: float = 0.5
    #: Interaction risk R(c) of safe, movable, fragile.
    risk: Probabilities = (0.5, 0.0, 0.5)
    #: Probability of being fragile above which an obstacle is not pushed.
    accepted_fragile: float = 0.6
    #: The same for an obstacle that a chain reaction would reach.
    accepted_fragile_chain: float = 0.3
    #: Probability of being safe above which an obstacle is not pushed.
    accepted_safe: float = 0.85
    #: Whether chain reactions are predicted before a push (an ablation).
    predict_cascades: bool = True
    #: Whether weights follow the battery (an ablation).
    battery_reweighting: bool = True
    #: Weights of J.
    weights: Weights = Weights()
    #: How fast, and how carefully, it pushes.
    push: PushSettings = PushSettings()
    #: What it learns from pushes.
    belief: BeliefSettings = BeliefSettings()

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        expect_between("robot_radius_m", self.robot_radius_m, 0.0, 1.0)
        for name in ("lambda_occ", "lambda_sem", "push_bias", "detour_margin"):
            expect_between(name, getattr(self, name), 0.0, 1000.0)
        expect_all_between("risk", self.risk, 3, 0.0, 1000.0)
        for name in ("accepted_fragile", "accepted_fragile_chain", "accepted_safe"):
            expect_between(name, getattr(self, name), 0.0, 1.0)


class BeaconPolicy(PushPolicy[BeaconConfig]):
    """Push if C_push - b_push < C_detour + m_detour, under the objective J."""

    Config = BeaconConfig

    def crossing_cost(
        self, obstacle: SensedObstacle, *, last_resort: bool
    ) -> float | None:
        """Return lambda_occ c_occ + lambda_sem E_b[R] where a push may succeed.

        c_occ is the share of the robot's force that the obstacle needs. As a last
        resort, what the belief advises against has a cost too: perceived forces are
        wrong by a fifth, classes in one case of five.
        """
        cfg, risk = self.config, self._risk(obstacle)
        share = self.force_n(obstacle) / self.task.force_max_n
        if self._advisable(obstacle):
            return cfg.lambda_occ * share + cfg.lambda_sem * risk
        if not last_resort or self.beliefs.at_least_n.get(obstacle.id, 0.0) > 0.0:
            return None
        return cfg.lambda_occ + cfg.lambda_sem * 2.0 * (risk + max(share, 1.0))

    def choose(
        self,
        observation: Observation,
        options: Iterator[list[PushPlan]],
        detour: FreeRoute,
    ) -> Decision | None:
        """Apply the printed rule to the best push and the way round (paper II.F)."""

        def compare(plans: list[PushPlan]) -> Decision:
            safe = [p for p in plans if self.chain_is_safe(p.moved(observation))]
            scored = [(self._terms(self._push(p, observation), observation), p)
                      for p in safe]  # fmt: skip
            way = detour_candidate(observation, self.task, detour)
            return decide(
                scored,
                None if way is None else self._terms(way, observation),
                bonus=self.config.push_bias,
                margin=self.config.detour_margin,
            )

        return decide_in_turn(options, detour, compare)

    def limits(self, observation: Observation, plan: PushPlan) -> PushLimits:
        """Touch slowly where something may break; a light touch is cheap."""
        obstacle = observation.obstacles[plan.index]
        fragility = self.beliefs.fragility(plan.moved(observation))
        return careful_limits(
            obstacle, self.force_n(obstacle), fragility, self.task, self.config.push
        )

    def chain_is_safe(self, moved: Sequence[SensedObstacle]) -> bool:
        """Whether no likely-fragile obstacle is in a chain reaction (paper II.G)."""
        return self.beliefs.chain_is_safe(moved, self.config.accepted_fragile_chain)

    def planning_radius_m(self, task: Task) -> float:
        """Return the radius with which collisions are checked [m]."""
        return self.config.robot_radius_m or task.radius_m

    @property
    def belief_settings(self) -> BeliefSettings:
        """How beliefs are updated."""
        return self.config.belief

    @property
    def predicts_cascades(self) -> bool:
        """Whether chain reactions are predicted before a push (paper II.G)."""
        return self.config.predict_cascades

    def _advisable(self, obstacle: SensedObstacle) -> bool:
        """Whether a push is not likely to fail, or to break what is pushed."""
        cfg = self.config
        safe, _, fragile = self.beliefs.beliefs[obstacle.id]
        return (
            fragile <= cfg.accepted_fragile
            and safe <= cfg.accepted_safe
            and self.force_n(obstacle) <= self.task.force_max_n
        )

    def _risk(self, obstacle: SensedObstacle) -> float:
        """Return E_b[R]."""
        return self.beliefs.expected(obstacle.id, self.config.risk)

    def _push(self, plan: PushPlan, observation: Observation) -> Candidate:
        """Return a push as a candidate; its risk is the worst of its chain."""
        obstacles = observation.obstacles
        return push_candidate(
            observation,
            self.task,
            plan,
            self.allowed_limits(observation, plan),
            risk=max(self._risk(o) for o in plan.moved(observation)),
            energy_j=math.fsum(
                self.force_n(obstacles[i]) * travel for i, travel in plan.cascade.moved
            ),
        )

    def _terms(self, q: Candidate, observation: Observation) -> dict[str, float]:
        """Return the terms of J for one candidate."""
        reweighting, weights = self.config.battery_reweighting, self.config.weights
        return objective(
            q, observation, self.task, weights, battery_reweighting=reweighting
        )


class Beacon(ContactPlanner[BeaconConfig]):
    """Belief-weighted choice between pushing and going round (paper II.B - II.I).

    Each obstacle carries a belief over its interaction class, updated by Bayes' rule
    from what pushes reveal. D* Lite plans on a cost map whose semantic part is the
    expected risk; where the path meets an obstacle, pushes and the way round are
    compared under

        push if C_push - b_push < C_detour + m_detour.

    As printed, a larger detour margin favours pushing; the rule is kept as printed.
    """

    Policy = BeaconPolicy
