"""A push policy of one's own: it pushes only what it is sure of.

The loop, the routes and the push controller are those of `beacon`.

Usage: python examples/own_push_policy.py
"""

from collections.abc import Iterator
from dataclasses import dataclass

import beacon_mj as bmj
from beacon_mj.motion.detour import FreeRoute


@dataclass(frozen=True, kw_only=True, slots=True)
class SureConfig:
    """When `Sure` pushes."""

    #: Probability of being movable from which it pushes, 0 to 1.
    least_movable: float = 0.8


class SurePolicy(bmj.PushPolicy[SureConfig]):
    """Push what is surely movable; else go round; as a last resort push anything."""

    Config = SureConfig

    def crossing_cost(
        self, obstacle: bmj.SensedObstacle, *, last_resort: bool
    ) -> float | None:
        """Return what a route through an obstacle costs [m/m], None if it blocks."""
        sure = self.beliefs.probability(obstacle.id, "movable")
        if sure >= self.config.least_movable:
            return 1.0
        return 10.0 if last_resort else None

    def choose(
        self,
        observation: bmj.Observation,
        options: Iterator[list[bmj.PushPlan]],
        detour: FreeRoute,
    ) -> bmj.Decision | None:
        """Take the first push there is, unless the way round is as short."""
        plans = next(options, None)
        if plans is None:
            return None
        plan = min(plans, key=lambda each: each.lead_m(observation.position_m))
        push_m = plan.lead_m(observation.position_m) + plan.travel_m
        return bmj.Decision(
            plan=plan if push_m < detour.length_m else None,
            cost_push=push_m,
            cost_detour=detour.length_m,
            terms={},
            reason=f"{plan.id} is surely movable.",
        )

    def limits(
        self, observation: bmj.Observation, plan: bmj.PushPlan
    ) -> bmj.PushLimits:
        """Touch gently, then push."""
        return bmj.PushLimits(touch_mps=0.1, push_mps=0.3)


class Sure(bmj.ContactPlanner[SureConfig]):
    """Pushes only what it is sure of."""

    Policy = SurePolicy


if __name__ == "__main__":
    results = bmj.evaluate(
        {"sure": Sure, "bold": (Sure, {"least_movable": 0.3})},
        families=["collision-required"],
        scenes_per_family=4,
        seed=1000,
        out="runs/sure",
    )
    print(results.table())
