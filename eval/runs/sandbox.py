"""A planner that is built anew for each episode, behind the episode's door."""

from collections.abc import Callable
from typing import Any, ClassVar

from beacon_mj.interface import Command, Observation, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.oracle.truth import Oracle, Truth


class Guarded(Oracle):
    """Builds a planner in `reset`, so that a failing constructor costs an episode too.

    The truth about a world is passed on to oracles and to no other planner.
    """

    Config: ClassVar[type[Any]] = dict

    def __init__(self, build: Callable[[], Planner]) -> None:
        """Guard the planner that `build` returns."""
        super().__init__({})
        self._build = build

    def set_truth(self, truth: Truth) -> None:
        """Keep the truth until it is known who asks."""
        self._truth = truth

    def reset(self, task: Task) -> None:
        """Build the planner and reset it."""
        self._planner = self._build()
        if isinstance(self._planner, Oracle):
            self._planner.set_truth(self._truth)
        self._planner.reset(task)

    def act(self, observation: Observation) -> Command:
        """Ask the planner."""
        return self._planner.act(observation)
