"""What a planner that touches things on purpose decides for itself.

`beacon_mj.planners.contact.loop` is the loop that asks.
"""

from abc import abstractmethod
from collections.abc import Sequence

from beacon_mj.interface import Observation, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.planners.base import Planner
from beacon_mj.planners.contact.belief import BeliefMap
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.contact.decision import Decision
from beacon_mj.planners.contact.limits import PushLimits


class PushPolicy(Planner):
    """What may be pushed, what it costs, how fast, and which way is better.

    Attributes:
        beliefs: Belief over each obstacle's class.
    """

    beliefs: BeliefMap
    _broken: set[str]

    def planning_radius_m(self, task: Task) -> float:
        """Radius with which collisions are checked [m]."""
        return task.radius_m

    @abstractmethod
    def _new_beliefs(self) -> BeliefMap:
        """Return an empty belief map for one episode."""

    @abstractmethod
    def push_cost(self, observation: Observation, index: int) -> float | None:
        """Return the cell cost of an obstacle that may be pushed, None if it may not.

        The cost is that of going right through it, in metres per metre.
        """

    @abstractmethod
    def compare(
        self, observation: Observation, plans: list[PushPlan], detour: FreeRoute
    ) -> Decision:
        """Choose among pushes and the way round (paper II.F)."""

    @abstractmethod
    def limits(self, observation: Observation, plan: PushPlan) -> PushLimits:
        """Return how fast a push may go."""

    def last_resort_cost(self, observation: Observation, index: int) -> float | None:
        """Return a cell cost for use when there is no other way, None for never."""
        return None

    def belief_changed(self, change_l1: float) -> bool:
        """Whether an L1 change of a belief calls for replanning (paper II.H)."""
        return change_l1 > 0.0

    @property
    def predicts_cascades(self) -> bool:
        """Whether chain reactions are predicted before a push (paper II.G)."""
        return True

    def fragility(self, observation: Observation, plan: PushPlan) -> float:
        """Return the largest probability of being fragile of what would move."""
        return max(
            self.beliefs.probability(observation.obstacles[i].id, "fragile")
            for i, _ in plan.cascade.moved
        )

    def chain_is_safe(self, moved: Sequence[str]) -> bool:
        """Whether no likely-fragile obstacle is in a chain reaction (paper II.G).

        Args:
            moved: What would move, the pushed obstacle first. It is struck as well
                as soon as it reaches another.
        """
        return len(moved) < 2 or all(
            self.beliefs.probability(name, "fragile") <= self.accepted_fragile_chain
            for name in moved
            if name not in self._broken
        )

    @property
    def accepted_fragile_chain(self) -> float:
        """Probability of being fragile up to which a chain reaction may reach it."""
        return 1.0
