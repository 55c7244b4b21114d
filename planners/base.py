"""The one interface that every planner implements."""

from abc import ABC, abstractmethod
from typing import Any, ClassVar

from beacon_mj.interface import Command, Observation, Task


class Planner(ABC):
    """Decides one velocity per control step from what the sensor reports.

    A planner is built from its own frozen `Config` dataclass, reset with the task of
    each episode, and then asked once per control step. It sees the world through
    `Observation` only: true class, mass, friction and break force are out of reach.

    Attributes:
        Config: The planner's configuration dataclass; every field has a default.
    """

    Config: ClassVar[type[Any]]

    def __init__(self, config: Any = None) -> None:
        """Build the planner. `config` is an instance of `Config`, or None."""
        self.config = self.Config() if config is None else config

    @abstractmethod
    def reset(self, task: Task) -> None:
        """Forget everything and start on `task`."""

    @abstractmethod
    def act(self, observation: Observation) -> Command:
        """Return the command for the next control period.

        Args:
            observation: What is known now. Read-only.

        Returns:
            A finite velocity [m/s], at most the task's speed limit (a faster one is
            scaled down), or a command with `give_up` set.
        """
