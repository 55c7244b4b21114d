"""Categorical belief over the interaction class of each obstacle (paper II.B, II.C).

Vectors are ordered as `CLASSES`: safe, movable, fragile.
"""

from dataclasses import dataclass, field

import numpy as np

from beacon_mj.constants import CLASSES, InteractionClass
from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array
from beacon_mj.interface import Evidence, Probabilities, PushEvidence, SensedObstacle


@dataclass(frozen=True, kw_only=True, slots=True)
class Likelihoods:
    """P(e | c) for each evidence e, over (safe, movable, fragile).

    The paper leaves the numbers open. These follow from the worlds' construction:
    safe bodies do not give way; one movable in ten is too heavy for the robot; fragile
    ones are light, and some break when pushed. For each class the three sum to one.
    """

    moved: Probabilities = (0.03, 0.90, 0.75)
    not_moved: Probabilities = (0.965, 0.095, 0.05)
    broken: Probabilities = (0.005, 0.005, 0.20)

    def __post_init__(self) -> None:
        """Check that P(. | c) is a distribution.

        Raises:
            PlannerError: If a probability is out of range or they do not sum to one.
        """
        table = np.array([self.moved, self.not_moved, self.broken])
        if (table <= 0.0).any() or np.abs(table.sum(axis=0) - 1.0).max() > 1e-9:
            raise PlannerError(
                "Expected the likelihoods of each class to be positive and sum to one "
                f"but they were {table.T.tolist()}."
            )

    def of(self, evidence: Evidence) -> Array:
        """Return P(evidence | c), shape (3,)."""
        return np.array(
            {"moved": self.moved, "not_moved": self.not_moved, "broken": self.broken}[
                evidence
            ]
        )


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
        likelihoods: P(e | c).
        update_belief: False freezes every belief at its prior (an ablation).
        beliefs: Class probabilities by obstacle id.
        at_least_n: Force that is known not to move an obstacle [N].
        at_most_n: Force that is known to move it [N].
        version: Grows whenever a belief or a bound changes.
    """

    likelihoods: Likelihoods = field(default_factory=Likelihoods)
    update_belief: bool = True
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
        if not self.update_belief or evidence.id not in self.beliefs:
            return 0.0
        before = np.array(self.beliefs[evidence.id])
        after = posterior(before, self.likelihoods.of(evidence.evidence))
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
