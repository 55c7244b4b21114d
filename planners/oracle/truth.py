"""What only an oracle is told: the truth about a world, and a rehearsal of it.

Plain data, like an observation: an oracle imports no scene and no physics. Who runs
the episode hands the truth over, and to subclasses of `Oracle` only.
"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from beacon_mj.constants import InteractionClass
from beacon_mj.geometry import Array, Footprint
from beacon_mj.planners.base import C, Planner


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TrueObstacle:
    """One obstacle as it is.

    Attributes:
        id: Its name.
        footprint: Outline on the floor before the first step.
        interaction: Its class.
        mass_kg: Its mass [kg].
        breakaway_force_n: Force that starts it sliding [N]; infinite if it is fixed.
        break_force_n: Contact force that breaks it [N]; infinite if nothing does.
    """

    id: str
    footprint: Footprint
    interaction: InteractionClass
    mass_kg: float
    breakaway_force_n: float
    break_force_n: float

    def pushable(self, force_n: float) -> bool:
        """Whether a robot of that force can move it, slowly, without damage."""
        return self.breakaway_force_n < min(force_n, self.break_force_n)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Rollout:
    """One rehearsal, from the start of the episode to its end.

    Attributes:
        reached: Whether the robot reached the goal.
        broken: Ids of the obstacles that broke.
        velocities_mps: The commands, one a control step, shape (s, 2) [m/s].
        positions_m: Centre of the robot, start included, shape (s + 1, 2) [m].
        detail: Why it ended, if the planner said so.
    """

    reached: bool
    broken: tuple[str, ...]
    velocities_mps: Array
    positions_m: Array
    detail: str

    @property
    def steps(self) -> int:
        """Control steps that it took."""
        return len(self.velocities_mps)

    @property
    def clean(self) -> bool:
        """Whether the goal was reached and nothing broke."""
        return self.reached and not self.broken


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Truth:
    """Everything about a world, before the first step.

    Attributes:
        obstacles: All obstacles.
        rehearse: Runs a planner through a copy of the world, from the start, with
            exact perception of every obstacle. The world is deterministic: the same
            commands have the same effects in the episode itself.
    """

    obstacles: tuple[TrueObstacle, ...]
    rehearse: Callable[[Planner], Rollout]


class Oracle(Planner[C]):
    """A planner that is told the truth: a reference planner, never a competitor."""

    @abstractmethod
    def set_truth(self, truth: Truth) -> None:
        """Take the truth about the next episode's world, before `reset`."""
