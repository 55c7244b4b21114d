"""The contact-aware semantic baseline: fixed weights, beliefs never updated."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from beacon_mj.interface import Observation, Probabilities, SensedObstacle
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.planners.checks import expect_all_between, expect_between
from beacon_mj.planners.contact.belief_settings import BeliefSettings
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.contact.decision import Decision, decide, decide_in_turn
from beacon_mj.planners.contact.limits import PushLimits
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
        expect_all_between("class_cost", self.class_cost, 3, 0.0, 1000.0)
        expect_between("cost_max", self.cost_max, 1e-6, 1000.0)
        expect_between("push_speed_mps", self.push_speed_mps, 0.01, 5.0)
        expect_between("touch_speed_mps", self.touch_speed_mps, 0.01, 5.0)


class SemanticPolicy(PushPolicy[SemanticConfig]):
    """The least of W_P J_pos + W_R J_risk_fixed + W_B J_res (paper App. A.D)."""

    Config = SemanticConfig

    @property
    def belief_settings(self) -> BeliefSettings:
        """What an obstacle seemed at first sight it remains."""
        return BeliefSettings(memory="failures")

    def crossing_cost(
        self, obstacle: SensedObstacle, *, last_resort: bool
    ) -> float | None:
        """Return the cost where the class permits contact, else a high last resort."""
        permitted = self._interaction(obstacle) < 1.0
        if permitted and obstacle.perceived_force_n <= self.task.force_max_n:
            return self.config.lambda_risk * self._fixed_risk(obstacle, contact=True)
        return 2.0 * self.config.lambda_risk if last_resort else None

    def choose(
        self,
        observation: Observation,
        options: Iterator[list[PushPlan]],
        detour: FreeRoute,
    ) -> Decision | None:
        """Take the candidate with the smallest fixed-weight objective."""

        def compare(plans: list[PushPlan]) -> Decision:
            scored = [(self._terms(self._push(p, observation), observation), p)
                      for p in plans]  # fmt: skip
            way = detour_candidate(observation, self.task, detour)
            return decide(
                scored, None if way is None else self._terms(way, observation)
            )

        return decide_in_turn(options, detour, compare)

    def limits(self, observation: Observation, plan: PushPlan) -> PushLimits:
        """Return the same speeds for every obstacle."""
        cfg = self.config
        return PushLimits(touch_mps=cfg.touch_speed_mps, push_mps=cfg.push_speed_mps)

    def _push(self, plan: PushPlan, observation: Observation) -> Candidate:
        """Return a push as a candidate; its risk is the worst of its chain."""
        moved = plan.moved(observation)
        return push_candidate(
            observation,
            self.task,
            plan,
            self.allowed_limits(observation, plan),
            risk=max(self._fixed_risk(o, contact=True) for o in moved),
            energy_j=math.fsum(
                observation.obstacles[i].perceived_force_n * travel
                for i, travel in plan.cascade.moved
            ),
        )

    def _fixed_risk(self, obstacle: SensedObstacle, *, contact: bool) -> float:
        """Return alpha J_geo + beta J_int; J_geo is one in contact, else zero."""
        alpha = self.config.alpha
        return alpha * float(contact) + (1.0 - alpha) * self._interaction(obstacle)

    def _interaction(self, obstacle: SensedObstacle) -> float:
        """Return J_int of the most likely class."""
        likely = int(np.argmax(self.beliefs.beliefs[obstacle.id]))
        return min(1.0, self.config.class_cost[likely] / self.config.cost_max)

    def _terms(self, q: Candidate, observation: Observation) -> dict[str, float]:
        """Return the weighted terms of the baseline's objective."""
        cfg = self.config
        weights = Weights(
            w_p=cfg.w_p, w_r_scale=cfg.w_r, w_v_floor=0.0, w_v_range=0.0,
            w_d=cfg.w_b, w_t=0.3 * cfg.w_b, w_e=cfg.w_b,
        )  # fmt: skip
        return objective(q, observation, self.task, weights, battery_reweighting=False)


class Semantic(ContactPlanner[SemanticConfig]):
    """Fixed-weight selection by the most likely class (paper App. A.D).

        q* = argmin W_P J_pos + W_R J_risk_fixed + W_B J_res
        J_risk_fixed = alpha J_geo + beta J_int,  J_int = min(1, c(c_hat) / c_max)

    with alpha + beta = 1. It shares BEACON's loop, candidates and push controller, so
    that a gap between the two is the worth of updating the belief: here an obstacle
    is, for good, what it most likely seemed at first sight.
    """

    Policy = SemanticPolicy
