"""The contact-aware semantic baseline: fixed weights, beliefs never updated."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from beacon_mj.interface import Observation, Probabilities
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.planners.checks import expect_between
from beacon_mj.planners.contact.belief import BeliefMap
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.contact.decision import Decision, decide
from beacon_mj.planners.contact.limits import PushLimits
from beacon_mj.planners.contact.loop import ContactPlanner
from beacon_mj.planners.contact.objective import (
    Candidate,
    Weights,
    detour_candidate,
    objective,
    push_candidate,
)


@dataclass(frozen=True, kw_only=True, slots=True)
class SemanticConfig:
    """Constant weights of the baseline (paper App. A.D), dimensionless."""

    #: Weight of the position term (W_P).
    w_p: float = 1.0
    #: Weight of the fixed risk (W_R).
    w_r: float = 1.0
    #: Weight of the resource term (W_B).
    w_b: float = 1.0
    #: Share of geometric risk in the risk; the interaction has the rest (alpha).
    alpha: float = 0.3
    #: Fixed interaction cost of safe, movable, fragile.
    class_cost: Probabilities = (0.8, 0.2, 1.0)
    #: Interaction cost that counts as one (c_max).
    cost_max: float = 1.0
    #: Cost of a cell in the cost map for a risk of one [m/m].
    lambda_risk: float = 7.5
    #: Speed of a push [m/s].
    push_speed_mps: float = 0.5
    #: Speed at which the bumper meets an obstacle [m/s].
    touch_speed_mps: float = 0.1

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        for name in ("w_p", "w_r", "w_b", "lambda_risk"):
            expect_between(name, getattr(self, name), 0.0, 1000.0)
        expect_between("alpha", self.alpha, 0.0, 1.0)
        expect_between("cost_max", self.cost_max, 1e-6, 1000.0)
        expect_between("push_speed_mps", self.push_speed_mps, 0.01, 5.0)
        expect_between("touch_speed_mps", self.touch_speed_mps, 0.01, 5.0)


class Semantic(ContactPlanner):
    """Fixed-weight selection by the most likely class (paper App. A.D).

        q* = argmin W_P J_pos + W_R J_risk_fixed + W_B J_res
        J_risk_fixed = alpha J_geo + beta J_int,  J_int = min(1, c(c_hat) / c_max)

    with alpha + beta = 1. It shares BEACON's loop, candidates and push controller, so
    that a gap between the two is the worth of updating the belief: here an obstacle
    is, for good, what it most likely seemed at first sight.
    """

    Config: ClassVar[type[SemanticConfig]] = SemanticConfig
    config: SemanticConfig

    def _new_beliefs(self) -> BeliefMap:
        return BeliefMap(update_belief=False)

    def push_cost(self, observation: Observation, index: int) -> float | None:
        """Return the cell cost of an obstacle whose class permits contact."""
        obstacle = observation.obstacles[index]
        if self._interaction(obstacle.id) >= 1.0:
            return None
        if obstacle.perceived_force_n > self._task.force_max_n:
            return None
        return self.config.lambda_risk * self._fixed_risk(obstacle.id, contact=True)

    def last_resort_cost(self, observation: Observation, index: int) -> float | None:
        """Return a high cost where there is no other way."""
        return 2.0 * self.config.lambda_risk

    def compare(
        self, observation: Observation, plans: list[PushPlan], detour: FreeRoute
    ) -> Decision:
        """Take the candidate with the smallest fixed-weight objective."""
        scored = [
            (self._terms(self._candidate(observation, p), observation), p)
            for p in plans
        ]
        way = detour_candidate(observation, self._task, detour)
        return decide(scored, None if way is None else self._terms(way, observation))

    def limits(self, observation: Observation, plan: PushPlan) -> PushLimits:
        """Return the same speeds for every obstacle."""
        cfg = self.config
        return PushLimits(touch_mps=cfg.touch_speed_mps, push_mps=cfg.push_speed_mps)

    def _candidate(self, observation: Observation, plan: PushPlan) -> Candidate:
        obstacles = observation.obstacles
        return push_candidate(
            observation,
            self._task,
            plan,
            self.limits(observation, plan),
            risk=max(
                self._fixed_risk(obstacles[i].id, contact=True)
                for i, _ in plan.cascade.moved
            ),
            energy_j=math.fsum(
                obstacles[i].perceived_force_n * travel
                for i, travel in plan.cascade.moved
            ),
        )

    def _fixed_risk(self, obstacle_id: str, *, contact: bool) -> float:
        """Return alpha J_geo + beta J_int; J_geo is one in contact, else zero."""
        alpha = self.config.alpha
        return alpha * float(contact) + (1.0 - alpha) * self._interaction(obstacle_id)

    def _interaction(self, obstacle_id: str) -> float:
        """Return J_int of the most likely class."""
        likely = int(np.argmax(self.beliefs.beliefs[obstacle_id]))
        return min(1.0, self.config.class_cost[likely] / self.config.cost_max)

    def _terms(self, q: Candidate, observation: Observation) -> dict[str, float]:
        """Return the weighted terms of the baseline's objective."""
        cfg = self.config
        weights = Weights(
            w_p=cfg.w_p, w_r_scale=cfg.w_r, w_v_floor=0.0, w_v_range=0.0,
            w_d=cfg.w_b, w_t=0.3 * cfg.w_b, w_e=cfg.w_b,
        )  # fmt: skip
        return objective(q, observation, self._task, weights, battery_reweighting=False)
