"""Policies that tests share: plain functions of the arrays of an observation."""

from typing import Any

import numpy as np

from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.base import Planner
from beacon_mj.rl.observer import Observer
from beacon_mj.rl.parts import Values


def straight(observation: dict[str, Values]) -> Any:
    """Return full speed at the goal, in single precision."""
    x, y, distance = observation["goal"]
    return np.array([x, y]) / np.maximum(distance, np.float32(0.1))


class Straight(Planner):
    """The same as a planner, as a user evaluates what was trained."""

    def reset(self, task: Task) -> None:
        self.observer = Observer()
        self.observer.reset(task)

    def act(self, observation: Observation) -> Command:
        action = straight(self.observer.arrays(observation))
        return Command(velocity_mps=self.observer.velocity_mps(action))
