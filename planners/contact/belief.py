"""Categorical belief over the interaction class of each obstacle (paper II.B, II.C).

Vectors are ordered as `CLASSES`: safe, movable, fragile.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from beacon_mj.constants import CLASSES, InteractionClass
from beacon_mj.errors import PlannerError
from beacon_mj.geometry import Array
from beacon_mj.interface import Evidence, Probabilities, PushEvidence, SensedObstacle
from beacon_mj.planners.checks import expect, expect_all_between, expect_between
from beacon_mj.planners.contact.force_scale import ScaleBelief
from beacon_mj.planners.contact.kinds import KindBeliefs

Memory = Literal["none", "failures", "belief"]
Sharing = Literal["kind", "scale"]
FORGET_S = 10.0  #: Time after which memory `none` has forgotten a failed push [s].
#: Standard deviation of the logarithm of one obstacle's perceived breakaway force.
FORCE_ERROR = 0.21


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

    #: What a push leaves behind: `none`, a failure is forgotten after 10 s; `failures`,
    #: it is remembered for good; `belief`, it updates the belief as well.
    memory: Memory = "belief"
    #: What a push tells of the other obstacles, where memory is `belief`: of those of
    #: its `kind`, and of the `scale` of all forces; `[]` for nothing, as in the paper.
    sharing: frozenset[Sharing] = frozenset()
    #: Probability, 0 to 1, that an obstacle has its kind's class: values that are
    #: equally likely until pushes tell how far kinds can be relied on.
    reliability: tuple[float, ...] = (0.0, 0.5, 1.0)
    #: Standard deviation of the logarithm of the scale, the factor between all
    #: perceived forces and the true ones; 0 where it is known to be one.
    scale_error: float = 0.0
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
        count = len(self.reliability)
        expect("reliability", self.reliability, "of 1 to 9 values", 0 < count < 10)
        expect_all_between("reliability", self.reliability, count, 0.0, 1.0)
        expect_between("scale_error", self.scale_error, 0.0, 3.0)
        for name, value, words in (
            ("memory", {self.memory}, get_args(Memory)),
            ("sharing", self.sharing, get_args(Sharing)),
        ):
            expect(
                name,
                getattr(self, name),
                f"of {', '.join(words)}",
                {*value} <= {*words},
            )

    def shares(self, what: Sharing) -> bool:
        """Whether a push tells of the other obstacles, through their kind or scale."""
        return self.memory == "belief" and what in self.sharing

    @property
    def failures_last_s(self) -> float:
        """For how long a failed push is remembered [s]."""
        return FORGET_S if self.memory == "none" else math.inf

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
        settings: What is learned, and shared; unless memory is `belief` every belief
            stays at its prior, and no bound is kept.
        force_error: Standard deviation of the logarithm of one obstacle's perceived
            force, the error of the scale aside; > 0.
        beliefs: Class probabilities by obstacle id.
        at_least_n: Force that is known not to move an obstacle [N].
        at_most_n: Force that is known to move it [N].
        kinds: Beliefs about kinds, where they are shared.
        scale: Belief about the scale of forces; one for sure, where it is not shared.
    """

    settings: BeliefSettings = field(default_factory=BeliefSettings)
    force_error: float = FORCE_ERROR
    beliefs: dict[str, Probabilities] = field(default_factory=dict)
    at_least_n: dict[str, float] = field(default_factory=dict)
    at_most_n: dict[str, float] = field(default_factory=dict)
    kinds: KindBeliefs = field(init=False)
    scale: ScaleBelief = field(init=False)
    _perceived_n: dict[str, float] = field(default_factory=dict)
    _factor: float = 1.0

    def __post_init__(self) -> None:
        """Start the beliefs about kinds and about the scale."""
        self.kinds = KindBeliefs(self.settings.reliability)
        width = self.settings.scale_error if self.settings.shares("scale") else 0.0
        self.scale = ScaleBelief(width, self.force_error)

    def sight(self, *obstacles: SensedObstacle) -> bool:
        """Start beliefs at first sight; return whether any is new."""
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
