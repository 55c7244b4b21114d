"""Categorical belief over the interaction class of each obstacle (paper II.B, II.C).

Vectors are ordered as `CLASSES`: safe, movable, fragile.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from beacon_mj.constants import CLASSES, InteractionClass
from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array
from beacon_mj.interface import Evidence, Probabilities, PushEvidence, SensedObstacle
from beacon_mj.planners.checks import expect, expect_all_between, expect_between


@dataclass(frozen=True, kw_only=True, slots=True)
class Likelihoods:
    """P(e | c) for each evidence e, over (safe, movable, fragile).

    The paper leaves the numbers open. These follow from the worlds' construction:
    safe bodies do not give way; one movable in ten is too heavy for the robot; fragile
    ones are light, and some break when pushed. For each class the three sum to one.
    """

    #: Probability that a safe, movable, fragile one gives way.
    moved: Probabilities = (0.03, 0.90, 0.75)
    #: The same that it does not.
    not_moved: Probabilities = (0.965, 0.095, 0.05)
    #: The same that it breaks.
    broken: Probabilities = (0.005, 0.005, 0.20)

    def __post_init__(self) -> None:
        """Check that P(. | c) is a distribution.

        Raises:
            PlannerError: If a probability is out of range or they do not sum to one.
        """
        for name in self.__slots__:
            values = getattr(self, name)
            expect_all_between(name, values, 3, 0.0, 1.0)
            expect(name, values, "positive", min(values) > 0.0)
        total = np.array([self.moved, self.not_moved, self.broken]).sum(axis=0)
        expect(
            "moved",
            self.moved,
            "such that moved, not_moved and broken sum to one in each class",
            bool(np.abs(total - 1.0).max() <= 1e-9),
        )

    def of(self, evidence: Evidence) -> Array:
        """Return P(evidence | c), shape (3,)."""
        return np.array(
            {"moved": self.moved, "not_moved": self.not_moved, "broken": self.broken}[
                evidence
            ]
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class BeliefSettings:
    """What a planner learns from its pushes, and when that makes it think again."""

    #: Whether contact evidence updates the belief (an ablation).
    update_belief: bool = True
    #: Whether a changed belief triggers replanning (an ablation).
    replan_on_belief: bool = True
    #: L1 change of a belief that triggers replanning (epsilon_b).
    threshold: float = 0.05
    #: P(e | c), what a push is expected to show.
    likelihoods: Likelihoods = Likelihoods()

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            PlannerError: If a field is out of range.
        """
        expect_between("threshold", self.threshold, 0.0, 2.0)

    def calls_for_replanning(self, change_l1: float) -> bool:
        """Whether |b' - b|_1 > epsilon_b (paper II.H)."""
        return self.replan_on_belief and change_l1 > self.threshold


def prior(scores: Probabilities) -> Array:
    """Return b_i^(0), the normalised class scores, shape (3,) (paper II.B).

    Raises:
        PlannerError: If the scores are negative or all zero.
    """
    values = np.array(scores)
    if (values < 0.0).any() or values.sum() <= 0.0:
        raise PlannerError(
            f"Expected scores >= 0 with a sum > 0 but they were {scores}."
        )
    return np.asarray(values / values.sum())


def posterior(belief: Array, likelihood: Array) -> Array:
    """Return b(c) P(e | c) / sum_c' b(c') P(e | c'), shape (3,) (paper II.C).

    Evidence that the belief holds impossible, as under a one-hot prior, changes
    nothing: Bayes' rule has no answer there.
    """
    joint = belief * likelihood
    total = float(joint.sum())
    return belief if total <= 0.0 else np.asarray(joint / total)


@dataclass(slots=True)
class BeliefMap:
    """Beliefs about all sensed obstacles, and bounds on the forces they need.

    Attributes:
        settings: What is learned; without `update_belief` every belief stays at its
            prior, and no bound is kept.
        beliefs: Class probabilities by obstacle id.
        at_least_n: Force that is known not to move an obstacle [N].
        at_most_n: Force that is known to move it [N].
        version: Grows whenever a belief or a bound changes.
    """

    settings: BeliefSettings = field(default_factory=BeliefSettings)
    beliefs: dict[str, Probabilities] = field(default_factory=dict)
    at_least_n: dict[str, float] = field(default_factory=dict)
    at_most_n: dict[str, float] = field(default_factory=dict)
    version: int = 0

    def sight(self, obstacle: SensedObstacle) -> bool:
        """Start a belief at first sight; return whether it is new."""
        if obstacle.id in self.beliefs:
            return False
        self._store(obstacle.id, prior(obstacle.scores))
        return True

    def learn(self, evidence: PushEvidence) -> float:
        """Update from one push attempt; return the L1 change of the belief (II.H)."""
        if not self.settings.update_belief or evidence.id not in self.beliefs:
            return 0.0
        before = np.array(self.beliefs[evidence.id])
        likelihood = self.settings.likelihoods.of(evidence.evidence)
        after = posterior(before, likelihood)
        self._store(evidence.id, after)
        self._bound(evidence)
        return float(np.abs(after - before).sum())

    def probability(self, obstacle_id: str, interaction: InteractionClass) -> float:
        """Return b_i(c) of one class."""
        return self.beliefs[obstacle_id][CLASSES.index(interaction)]

    def expected(self, obstacle_id: str, values: Probabilities) -> float:
        """Return E_{c ~ b_i}[values(c)]."""
        b = self.beliefs[obstacle_id]
        return b[0] * values[0] + b[1] * values[1] + b[2] * values[2]

    def force_n(self, obstacle: SensedObstacle) -> float:
        """Return F_i: the perceived Coulomb force, within what pushes revealed [N]."""
        force = obstacle.perceived_force_n
        force = min(force, self.at_most_n.get(obstacle.id, np.inf))
        return max(force, self.at_least_n.get(obstacle.id, 0.0))

    def fragility(self, obstacles: Sequence[SensedObstacle]) -> float:
        """Return the largest probability of being fragile among some obstacles."""
        return max(self.probability(o.id, "fragile") for o in obstacles)

    def chain_is_safe(
        self, moved: Sequence[SensedObstacle], accepted_fragile: float
    ) -> bool:
        """Whether no likely-fragile obstacle is in a chain reaction (paper II.G).

        Args:
            moved: What would move, the pushed obstacle first. It is struck as well
                as soon as it reaches another. What is broken breaks no more.
            accepted_fragile: Probability of being fragile that is accepted.
        """
        whole = [obstacle for obstacle in moved if not obstacle.broken]
        return len(moved) < 2 or not whole or self.fragility(whole) <= accepted_fragile

    def _store(self, obstacle_id: str, belief: Array) -> None:
        a, b, c = (float(p) for p in belief)
        self.beliefs = {**self.beliefs, obstacle_id: (a, b, c)}
        self.version += 1

    def _bound(self, evidence: PushEvidence) -> None:
        i, force = evidence.id, evidence.force_n
        if evidence.evidence == "not_moved":
            self.at_least_n[i] = max(force, self.at_least_n.get(i, 0.0))
        elif evidence.evidence == "moved":
            self.at_most_n[i] = min(force, self.at_most_n.get(i, np.inf))
