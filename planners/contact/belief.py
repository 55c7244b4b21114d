"""Categorical belief over the interaction class of each obstacle (paper II.B, II.C).

Vectors are ordered as `CLASSES`: safe, movable, fragile.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from beacon_mj.constants import CLASSES, InteractionClass
from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array
from beacon_mj.interface import Probabilities, PushEvidence, SensedObstacle
from beacon_mj.planners.contact.belief_settings import BeliefSettings
from beacon_mj.planners.contact.force_scale import ScaleBelief
from beacon_mj.planners.contact.kinds import KindBeliefs


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
        settings: What is learned, and shared; unless memory is `belief` every belief
            stays at its prior, and no bound is kept.
        force_error: Standard deviation of the logarithm of one obstacle's perceived
            force, the error of the scale aside; > 0.
        beliefs: Class probabilities by obstacle id; on later days of a mission also of
            obstacles that were not seen yet.
        at_least_n: Force that is known not to move an obstacle [N].
        at_most_n: Force that is known to move it [N].
        kinds: Beliefs about kinds, where they are shared.
        scale: Belief about the scale of forces; one for sure, where it is not shared.
    """

    settings: BeliefSettings = field(default_factory=BeliefSettings)
    force_error: float = 0.2
    beliefs: dict[str, Probabilities] = field(default_factory=dict)
    at_least_n: dict[str, float] = field(default_factory=dict)
    at_most_n: dict[str, float] = field(default_factory=dict)
    kinds: KindBeliefs = field(init=False)
    scale: ScaleBelief = field(init=False)
    _seen: set[str] = field(default_factory=set)
    _perceived_n: dict[str, float] = field(default_factory=dict)
    _factor: float = 1.0

    def __post_init__(self) -> None:
        """Start the beliefs about kinds and about the scale."""
        self.kinds = KindBeliefs(self.settings.reliability)
        scale_error = self.settings.scale_error or 0.0
        if self.settings.shares("scale"):
            self.scale = ScaleBelief(scale_error, self.force_error)
        else:  # Each force is then uncertain by both, and on its own.
            both = self.force_error * self.force_error + scale_error * scale_error
            self.scale = ScaleBelief(0.0, math.sqrt(both))

    def sight(self, *obstacles: SensedObstacle) -> bool:
        """Start beliefs at first sight; return whether any is new."""
        self._seen |= {o.id for o in obstacles}
        new = [o for o in obstacles if o.id not in self.beliefs]
        first = {o.id: _probabilities(prior(o.scores)) for o in new}
        self._store(first)
        for obstacle in new:
            self._perceived_n[obstacle.id] = obstacle.perceived_force_n
            if obstacle.kind is not None and self.settings.shares("kind"):
                self.kinds.sight(obstacle.id, obstacle.kind, first[obstacle.id])
        if any(name in self.kinds.kind_of for name in first):
            self._store(self.kinds.beliefs())
        return bool(new)

    def next_day(self) -> None:
        """Take note that nothing was seen yet on this day."""
        self._seen = set()

    @property
    def seen(self) -> int:
        """Number of obstacles that were seen on this day."""
        return len(self._seen)

    @property
    def of_seen(self) -> dict[str, Probabilities]:
        """Class probabilities of the obstacles that were seen on this day."""
        if len(self._seen) == len(self.beliefs):
            return self.beliefs
        return {i: b for i, b in self.beliefs.items() if i in self._seen}

    def learn(self, evidence: PushEvidence) -> float:
        """Update from one push; return the largest L1 change of a belief (II.H).

        The change of the belief about the scale counts as well.
        """
        if self.settings.memory != "belief" or evidence.id not in self.beliefs:
            return 0.0
        before, weights = self.beliefs, self.scale.weights
        self._learn_scale(evidence)
        self._learn_class(evidence)
        self._bound(evidence)
        changes = [_l1(weights, self.scale.weights)]
        changes += [_l1(old, self.beliefs[i]) for i, old in before.items()]
        return max(changes)

    def _learn_class(self, evidence: PushEvidence) -> None:
        """Apply Bayes' rule to the obstacle, or to all of its kind."""
        i = evidence.id
        likelihood = self.settings.likelihoods.of(evidence.evidence)
        if i in self.kinds.kind_of:
            self.kinds.learn(i, likelihood.tolist())
            self._store(self.kinds.beliefs())
        else:
            after = posterior(np.array(self.beliefs[i]), likelihood)
            self._store({i: _probabilities(after)})

    def _learn_scale(self, evidence: PushEvidence) -> None:
        """Take in the first push of an obstacle; a second would say the same again."""
        i = evidence.id
        if not (i in self.at_least_n or i in self.at_most_n):
            gives_way = 1.0 - self.probability(i, "safe")
            self.scale.learn(
                self._perceived_n[i], evidence.evidence, evidence.force_n, gives_way
            )
            self._factor = self.scale.factor

    def probability(self, obstacle_id: str, interaction: InteractionClass) -> float:
        """Return b_i(c) of one class."""
        return self.beliefs[obstacle_id][CLASSES.index(interaction)]

    def expected(self, obstacle_id: str, values: Probabilities) -> float:
        """Return E_{c ~ b_i}[values(c)]."""
        b = self.beliefs[obstacle_id]
        return b[0] * values[0] + b[1] * values[1] + b[2] * values[2]

    def force_n(self, obstacle: SensedObstacle) -> float:
        """Return F_i: the perceived Coulomb force, within what pushes revealed [N].

        The perceived force counts by the scale that pushes of others revealed.
        """
        force = self._factor * obstacle.perceived_force_n
        force = min(force, self.at_most_n.get(obstacle.id, np.inf))
        return max(force, self.at_least_n.get(obstacle.id, 0.0))

    def probability_below(self, obstacle: SensedObstacle, limit_n: float) -> float:
        """Return P(F_i < limit) of an obstacle that has not moved yet.

        Log-normal about the perceived force, and about the scale where it is shared.
        """
        return self.scale.probability_below(obstacle.perceived_force_n, limit_n)

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

    def _store(self, beliefs: Mapping[str, Probabilities]) -> None:
        self.beliefs = {**self.beliefs, **beliefs}

    def _bound(self, evidence: PushEvidence) -> None:
        i, force = evidence.id, evidence.force_n
        if evidence.evidence == "not_moved":
            self.at_least_n[i] = max(force, self.at_least_n.get(i, 0.0))
        elif evidence.evidence == "moved":
            self.at_most_n[i] = min(force, self.at_most_n.get(i, np.inf))


def _probabilities(belief: Array) -> Probabilities:
    """Return a belief of shape (3,) as plain numbers."""
    a, b, c = (float(p) for p in belief)
    return a, b, c


def _l1(before: Sequence[float], after: Sequence[float]) -> float:
    return math.fsum(abs(a - b) for a, b in zip(after, before, strict=True))
