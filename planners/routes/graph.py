"""What only planners on the route graph are told: the graph, and the prior.

It is the problem of the scene's certificate of learning: stages, drive times, and how
likely each door opens. Nothing in it depends on what is true of the doors. Plain data,
like an observation; who runs the episode hands it to subclasses of `RoutePlanner` only.
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

from beacon_mj.learning import DoorPart, DoorProblem, DoorStage
from beacon_mj.planners.base import C, Planner


class StageRef(NamedTuple):
    """A stage: the number of its part, and its own in the part."""

    part: int
    stage: int


@dataclass(frozen=True, kw_only=True, slots=True)
class RouteGraph:
    """The route graph of a scene.

    Attributes:
        problem: Stages, drive times at full speed [s], and the prior of every part. Of
            a mission, those of all its days.
        doors: Ids of the obstacles that are doors, by part and number.
        today: The stages that lie between start and goal, in order.
    """

    problem: DoorProblem
    doors: tuple[tuple[str, ...], ...]
    today: tuple[StageRef, ...]

    def part(self, ref: StageRef) -> DoorPart:
        """Return the part of a stage."""
        return self.problem.parts[ref.part]

    def stage(self, ref: StageRef) -> DoorStage:
        """Return a stage."""
        return self.part(ref).stages[ref.stage]

    def names(self, ref: StageRef) -> tuple[str, ...]:
        """Return the obstacles that are the doors of a stage, in its order."""
        ids = self.doors[ref.part]
        return tuple(ids[number] for number in self.stage(ref).doors)


class RoutePlanner(Planner[C]):
    """A planner that is told the route graph: a reference planner, no competitor."""

    @abstractmethod
    def set_routes(self, routes: RouteGraph | None) -> None:
        """Take the next episode's route graph, before `reset`.

        Args:
            routes: The graph; None in a scene without a certificate of learning.
        """
