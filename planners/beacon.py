"""BEACON: belief-aware replanning, the paper's method, whole."""

import math
from dataclasses import dataclass, fields
from typing import ClassVar

from beacon_mj.interface import Observation, Probabilities, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.contact.belief import BeliefMap, Likelihoods
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.contact.decision import Decision, decide
from beacon_mj.planners.contact.limits import PushLimits, careful_limits
from beacon_mj.planners.contact.loop import ContactPlanner
from beacon_mj.planners.contact.objective import (
    Candidate,
    Weights,
    detour_candidate,
    objective,
    push_candidate,
)


@dataclass(frozen=True, kw_only=True, slots=True)
class BeaconConfig:
    """Parameters of BEACON; defaults of Table I where the paper has them."""

    #: Radius with which the planner checks collisions; 0 means the robot's own [m].
    robot_radius_m: float = 0.0
    #: Weight of contact energy in J (w_e).
    w_e: float = 1.0
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
    #: L1 change of a belief that triggers replanning (epsilon_b).
    belief_threshold: float = 0.05
    #: Probability of being fragile above which an obstacle is not pushed.
    accepted_fragile: float = 0.6
    #: The same for an obstacle that a chain reaction would reach.
    accepted_fragile_chain: float = 0.3
    #: Probability of being safe above which an obstacle is not pushed.
    accepted_safe: float = 0.85
    #: Touching force that is allowed where something may break [N].
    gentle_force_n: float = 10.0
    #: Bumper force above which a push of something that may break slows down [N].
    fragile_force_n: float = 14.0
    #: Speed of a push [m/s].
    push_speed_mps: float = 0.5
    #: Whether contact evidence updates the belief (an ablation).
    update_belief: bool = True
    #: Whether a changed belief triggers replanning (an ablation).
    replan_on_belief: bool = True
    #: Whether chain reactions are predicted before a push (an ablation).
    predict_cascades: bool = True
    #: Whether weights follow the battery (an ablation).
    battery_reweighting: bool = True
    #: Weight of the position term of J (w_p).
    w_p: float = 1.0
    #: Weight of the risk term of J at full battery (w_r scale).
    w_r_scale: float = 1.0
    #: Weight of the velocity term of J at full battery (w_v floor).
    w_v_floor: float = 0.05
    #: What the velocity term gains until the battery is empty (w_v range).
    w_v_range: float = 0.1
    #: Weight of distance in J, per metre (w_d).
    w_d: float = 1.0
    #: Weight of time in J, per second (w_t).
    w_t: float = 0.3

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        expect_between("robot_radius_m", self.robot_radius_m, 0.0, 1.0)
        for name in ("w_e", "lambda_occ", "lambda_sem", "push_bias", "detour_margin"):
            expect_between(name, getattr(self, name), 0.0, 1000.0)
        for name in ("accepted_fragile", "accepted_fragile_chain", "accepted_safe"):
            expect_between(name, getattr(self, name), 0.0, 1.0)
        self.weights()
        expect_between("belief_threshold", self.belief_threshold, 0.0, 2.0)
        expect_between("gentle_force_n", self.gentle_force_n, 0.1, 1000.0)
        expect_between("fragile_force_n", self.fragile_force_n, 0.1, 1000.0)
        expect_between("push_speed_mps", self.push_speed_mps, 0.01, 5.0)

    def weights(self) -> Weights:
        """Return the weights of J."""
        return Weights(**{f.name: getattr(self, f.name) for f in fields(Weights)})


class Beacon(ContactPlanner):
    """Belief-weighted choice between pushing and going round (paper II.B - II.I).

    Each obstacle carries a belief over its interaction class, updated by Bayes' rule
    from what pushes reveal. D* Lite plans on a cost map whose semantic part is the
    expected risk; where the path meets an obstacle, pushes and the way round are
    compared under

        push if C_push - b_push < C_detour + m_detour.

    As printed, a larger detour margin favours pushing; the rule is kept as printed.
    """

    Config: ClassVar[type[BeaconConfig]] = BeaconConfig
    config: BeaconConfig

    def _new_beliefs(self) -> BeliefMap:
        return BeliefMap(Likelihoods(), update_belief=self.config.update_belief)

    def reset(self, task: Task) -> None:
        """Forget everything."""
        super().reset(task)
        self._weights = self.config.weights()

    def planning_radius_m(self, task: Task) -> float:
        """Radius with which collisions are checked [m]; the body's may differ."""
        return self.config.robot_radius_m or task.radius_m

    @property
    def predicts_cascades(self) -> bool:
        """Whether chain reactions are predicted before a push (paper II.G)."""
        return self.config.predict_cascades

    @property
    def accepted_fragile_chain(self) -> float:
        """Probability of being fragile up to which a chain reaction may reach it."""
        return self.config.accepted_fragile_chain

    def belief_changed(self, change_l1: float) -> bool:
        """Whether |b' - b|_1 > epsilon_b (paper II.H)."""
        cfg = self.config
        return cfg.replan_on_belief and change_l1 > cfg.belief_threshold

    def push_cost(self, observation: Observation, index: int) -> float | None:
        """Return lambda_occ + lambda_sem E_b[R] where a push may succeed."""
        cfg, obstacle = self.config, observation.obstacles[index]
        safe, _, fragile = self.beliefs.beliefs[obstacle.id]
        if fragile > cfg.accepted_fragile or safe > cfg.accepted_safe:
            return None
        if self.beliefs.force_n(obstacle) > self._task.force_max_n:
            return None
        share = self.beliefs.force_n(obstacle) / self._task.force_max_n
        return cfg.lambda_occ * share + cfg.lambda_sem * self._risk(obstacle.id)

    def last_resort_cost(self, observation: Observation, index: int) -> float | None:
        """Return a cost for what the belief advises against, when nothing else is left.

        Perceived forces are wrong by a fifth, classes in one case of five.
        """
        cfg, obstacle = self.config, observation.obstacles[index]
        if self.beliefs.at_least_n.get(obstacle.id, 0.0) > 0.0:
            return None
        excess = self.beliefs.force_n(obstacle) / self._task.force_max_n
        risk = self._risk(obstacle.id) + max(excess, 1.0)
        return cfg.lambda_occ + cfg.lambda_sem * 2.0 * risk

    def compare(
        self, observation: Observation, plans: list[PushPlan], detour: FreeRoute
    ) -> Decision:
        """Apply the printed rule to the best push and the way round (paper II.F)."""
        scored = [
            (self._terms(self._push_candidate(observation, p), observation), p)
            for p in plans
            if self.chain_is_safe(
                [observation.obstacles[i].id for i, _ in p.cascade.moved]
            )
        ]
        way = detour_candidate(observation, self._task, detour)
        return decide(
            scored,
            None if way is None else self._terms(way, observation),
            bonus=self.config.push_bias,
            margin=self.config.detour_margin,
        )

    def limits(self, observation: Observation, plan: PushPlan) -> PushLimits:
        """Touch slowly where something may break; a light touch is cheap."""
        obstacle = observation.obstacles[plan.index]
        need_n = self.beliefs.force_n(obstacle)
        fragility = self.fragility(observation, plan)
        return careful_limits(obstacle, need_n, fragility, self._task, self.config)

    def _push_candidate(self, observation: Observation, plan: PushPlan) -> Candidate:
        """Return a push as a candidate; its risk is the worst of its chain."""
        obstacles = observation.obstacles
        return push_candidate(
            observation,
            self._task,
            plan,
            self.limits(observation, plan),
            risk=max(self._risk(obstacles[i].id) for i, _ in plan.cascade.moved),
            energy_j=math.fsum(
                self.beliefs.force_n(obstacles[i]) * travel
                for i, travel in plan.cascade.moved
            ),
        )

    def _risk(self, obstacle_id: str) -> float:
        return self.beliefs.expected(obstacle_id, self.config.risk)

    def _terms(
        self, candidate: Candidate, observation: Observation
    ) -> dict[str, float]:
        """Return the terms of J for one candidate."""
        cfg = self.config
        return objective(
            candidate,
            observation,
            self._task,
            self._weights,
            battery_reweighting=cfg.battery_reweighting,
        )
