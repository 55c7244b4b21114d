"""The one interface that every planner implements."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic

from beacon_mj.interface import Command, Observation, Task

if TYPE_CHECKING:
    # Type checkers bundle this one. A bare `Planner` then means `Planner[Any]`.
    from typing_extensions import TypeVar

    C = TypeVar("C", default=Any)
else:
    from typing import TypeVar

    C = TypeVar("C")


@dataclass(frozen=True, kw_only=True, slots=True)
class NoConfig:
    """Configuration of a planner without parameters."""


class Planner(ABC, Generic[C]):
    """Decides one velocity per control step from what the sensor reports.

    A planner is built from its configuration, reset with the task of each episode, and
    then asked once per control step. On each further day of a mission it is told
    `next_day` in place of `reset`. It sees the world through `Observation` only: true
    class, mass, friction and break force are out of reach.

    A planner with parameters says so twice, for people and for type checkers:

        class Mine(Planner[MineConfig]):
            Config = MineConfig

    Attributes:
        Config: Frozen dataclass of parameters; every field has a default. Empty unless
            a planner names its own.
        bit_reproducible: Whether the planner decides the same, bit for bit, on every
            machine and each time. One that does not, such as a neural network on a
            GPU, says so with False: its tables carry a note, and running it again
            proves rates in place of rows.
        config: The parameters of this planner.
    """

    Config: ClassVar[type[Any]] = NoConfig
    bit_reproducible: ClassVar[bool] = True

    def __init__(self, config: C | None = None) -> None:
        """Build the planner. `config` is an instance of `Config`; None for defaults."""
        self.config: C = self.Config() if config is None else config

    @classmethod
    def missing(cls) -> list[str]:
        """Return what the class still has to define before it can be built."""
        return sorted(cls.__abstractmethods__)

    @abstractmethod
    def reset(self, task: Task) -> None:
        """Forget everything and start on `task`."""

    def next_day(self, task: Task) -> None:
        """Start on `task`, the next day of the mission that the planner is in.

        Obstacles keep their ids overnight, but not always their places. A planner that
        knows nothing of missions forgets everything: this is `reset`. One that keeps
        what it learned defines this method, and calls it for no other mission: after a
        day on which it failed, it is built anew and `reset`.
        """
        self.reset(task)

    @abstractmethod
    def act(self, observation: Observation) -> Command:
        """Return the command for the next control period.

        Args:
            observation: What is known now. Read-only.

        Returns:
            A finite velocity [m/s], at most the task's speed limit (a faster one is
            scaled down), or a command with `give_up` set.
        """
