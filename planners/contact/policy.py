"""What a planner that touches things on purpose decides for itself.

The loop in `beacon_mj.planners.contact.loop` plans, drives and pushes. It asks a
`PushPolicy` what may be pushed, what that costs, and whether to. A new policy defines
three methods, and a planner that names it has nothing else to do:

    class Mine(ContactPlanner[MineConfig]):
        Policy = MyPolicy
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Generic, final

from beacon_mj.interface import Observation, PushEvidence, SensedObstacle, Task
from beacon_mj.motion.detour import FreeRoute
from beacon_mj.planners.base import C, NoConfig
from beacon_mj.planners.contact.belief import BeliefMap
from beacon_mj.planners.contact.belief_settings import BeliefSettings
from beacon_mj.planners.contact.candidates import PushPlan
from beacon_mj.planners.contact.decision import Decision
from beacon_mj.planners.contact.limits import PushLimits, within_sheet

#: Least error of a perceived force that is believed: friction is not that exact.
LEAST_ERROR = 0.01
#: Standard deviations by which the noise of a felt force may have shifted it: forces of
#: two days contradict each other only where both may be as far off as that.
NOISE_SDS = 3.0


class PushPolicy(ABC, Generic[C]):
    """What may be pushed, what it costs, and what was learned; no state of the loop.

    Abstract are `crossing_cost`, `choose` and `limits`. In the order of an episode the
    loop calls `reset` once, or `next_day` on a further day of a mission; `observe` and
    `learn` in each step; `pushed` after a push; and when plans are stale
    `crossing_cost` for every obstacle, then `choose`, then `limits`.

    Attributes:
        Config: Frozen dataclass of parameters; every field has a default.
        config: The parameters of this policy.
        task: The task of the episode.
        beliefs: Class probabilities of each obstacle seen, and what pushes revealed of
            the forces.
    """

    Config: ClassVar[type[Any]] = NoConfig

    def __init__(self, config: C | None = None) -> None:
        """Build the policy. `config` is an instance of `Config`; None for defaults."""
        self.config: C = self.Config() if config is None else config

    def reset(self, task: Task) -> None:
        """Forget everything and start on `task`."""
        self.task = task
        self.beliefs = self._fresh_beliefs()
        self._inherits = False
        self._today: list[PushEvidence] = []

    def next_day(self, task: Task) -> None:
        """Start on the next day of a mission, with the beliefs if they are kept."""
        kept = self.beliefs
        self.reset(task)
        if self.belief_settings.belief_overnight:
            self.beliefs, self._inherits = kept, True
            kept.next_day()

    def contradicts(self, evidence: PushEvidence) -> bool:
        """Whether a push, not learned yet, shows that the room changed overnight.

        What moved on an earlier day withstands the same force now, or the reverse, and
        not by the noise of felt forces.
        """
        name, force_n = evidence.id, evidence.force_n
        if not self._inherits or any(name == told.id for told in self._today):
            return False
        noise = NOISE_SDS * self.task.sensor.force_noise
        least, most = max(1.0 - noise, 0.0), 1.0 + noise
        if evidence.evidence == "not_moved":
            limit_n = self.beliefs.at_most_n.get(name, math.inf)
            return least * force_n >= most * limit_n
        return most * force_n < least * self.beliefs.at_least_n.get(name, 0.0)

    def doubt(self, observation: Observation) -> bool:
        """Believe only what this day has shown; return whether that is a change.

        The room may have changed overnight, and nobody says so.
        """
        if not self._inherits:
            return False
        self._inherits = False
        self.beliefs = self._fresh_beliefs()
        self.beliefs.sight(*observation.obstacles)
        for evidence in self._today:
            self.beliefs.learn(evidence)
        return True

    def _fresh_beliefs(self) -> BeliefMap:
        settings = self.belief_settings
        if settings.scale_error is None:
            error = self.task.sensor.force_scale_error
            settings = replace(settings, scale_error=error)
        return BeliefMap(settings, max(self.force_error, LEAST_ERROR))

    def observe(self, observation: Observation) -> None:
        """Take in what is seen, in every control step before anything else."""
        self.beliefs.sight(*observation.obstacles[self.beliefs.seen :])

    def learn(self, evidence: PushEvidence) -> bool:
        """Take in how a push attempt ended; return whether plans are stale."""
        self._today.append(evidence)
        change_l1 = self.beliefs.learn(evidence)
        return self.belief_settings.calls_for_replanning(change_l1)

    def pushed(self, obstacle: SensedObstacle, *, failed: bool) -> None:
        """Take in that a push is over, whether or not it left evidence.

        Args:
            obstacle: What was pushed, as it is seen now.
            failed: Whether it did not give way, or no further.
        """

    @abstractmethod
    def crossing_cost(
        self, obstacle: SensedObstacle, *, last_resort: bool
    ) -> float | None:
        """Return what it costs to go right through an obstacle, None if it blocks.

        Args:
            obstacle: One that did not withstand two pushes, as it is seen now.
            last_resort: Whether nothing else is left. A policy may then name a cost
                for what it would rather not push.

        Returns:
            Extra cost in metres per metre of way, >= 0.
        """

    @abstractmethod
    def choose(
        self,
        observation: Observation,
        options: Iterator[list[PushPlan]],
        detour: FreeRoute,
    ) -> Decision | None:
        """Choose a push or the detour (paper II.F).

        Args:
            observation: What is known now.
            options: The feasible pushes of one obstacle after the other, that on the
                cheapest way through first. Each is planned when it is asked for, as if
                those before it could not be pushed: take as many as you will compare.
            detour: The way round. Its `path` is None where there is none, and its
                `length_m` then infinite.

        Returns:
            The decision; None if there was no option.
        """

    @abstractmethod
    def limits(self, observation: Observation, plan: PushPlan) -> PushLimits:
        """Return how fast, and how hard, a push should go.

        How fast it does go is also the sensor's to say: see `allowed_limits`.
        """

    @final
    def allowed_limits(self, observation: Observation, plan: PushPlan) -> PushLimits:
        """Return `limits` as far as the sensor's data sheet allows them.

        All planners that push are held to it, and carry out their pushes so.
        """
        limits = self.limits(observation, plan)
        fragility = self.beliefs.fragility(plan.moved(observation))
        return within_sheet(limits, fragility, self.task.sensor)

    def force_n(self, obstacle: SensedObstacle) -> float:
        """Return the force that is expected to move an obstacle [N]."""
        return self.beliefs.force_n(obstacle)

    def chain_is_safe(self, moved: Sequence[SensedObstacle]) -> bool:
        """Whether a push may go on that is about to move all of these.

        Args:
            moved: What would move, the pushed obstacle first.
        """
        return True

    def planning_radius_m(self, task: Task) -> float:
        """Return the radius with which collisions are checked [m]."""
        return task.radius_m

    @property
    def belief_settings(self) -> BeliefSettings:
        """How beliefs are updated."""
        return BeliefSettings()

    @property
    def force_error(self) -> float:
        """Standard deviation of the logarithm of true over perceived breakaway force.

        That of one obstacle; by default what the sensor's data sheet says.
        """
        return self.task.sensor.force_error

    @property
    def predicts_cascades(self) -> bool:
        """Whether chain reactions are predicted before a push (paper II.G)."""
        return True

    @property
    def expansions(self) -> int:
        """Grid vertices expanded by searches of the policy's own since `reset`."""
        return 0
