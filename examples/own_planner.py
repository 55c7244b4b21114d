"""A planner of one's own: it slows down near whatever may break.

Usage: python examples/own_planner.py
"""

from dataclasses import dataclass

import numpy as np

import beacon_mj as bmj

FRAGILE = 2  # Class scores have the order safe, movable, fragile.


@dataclass(frozen=True, kw_only=True, slots=True)
class WaryConfig:
    """When `Wary` slows down."""

    #: Speed near what may break [m/s].
    slow_mps: float = 0.1
    #: Probability of being fragile from which it slows down, 0 to 1.
    doubt: float = 0.1


class Wary(bmj.Planner[WaryConfig]):
    """Straight to the goal, slowly where something may break."""

    Config = WaryConfig

    def reset(self, task: bmj.Task) -> None:
        """Take note of the goal."""
        self.task = task

    def act(self, observation: bmj.Observation) -> bmj.Command:
        """Drive at the goal."""
        here = observation.position_m
        towards = self.task.goal_m - here
        gaps = observation.footprints.distance(here) - self.task.radius_m
        careful = any(
            gap < 0.2 and each.scores[FRAGILE] >= self.config.doubt * sum(each.scores)
            for each, gap in zip(observation.obstacles, gaps, strict=True)
        )
        speed = self.config.slow_mps if careful else self.task.speed_mps
        return bmj.Command(velocity_mps=speed * towards / np.hypot(*towards))


if __name__ == "__main__":
    bmj.check_planner(Wary)
    results = bmj.evaluate(
        ["push-through", Wary],
        families=["cluttered"],
        scenes_per_family=4,
        seed=1000,
        out="runs/wary",
    )
    print(results.table())
    print(results.rows.select("planner", "scene_index", "outcome", "obstacles_broken"))
