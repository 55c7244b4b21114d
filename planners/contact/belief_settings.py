"""What is learned from pushes, how, and for how long."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import Evidence, Probabilities
from beacon_mj.planners.checks import expect, expect_all_between, expect_between

Memory = Literal["none", "failures", "belief"]
Sharing = Literal["kind", "scale"]
Overnight = Literal["nothing", "failures", "belief"]
FORGET_S = 10.0  #: Time after which memory `none` has forgotten a failed push [s].


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
    #: What is kept from one day of a mission to the next: `nothing`; `failures`, which
    #: obstacles withstood; `belief`, everything that the memory holds.
    overnight: Overnight = "belief"
    #: Probability, 0 to 1, that an obstacle has its kind's class: values that are
    #: equally likely until pushes tell how far kinds can be relied on.
    reliability: tuple[float, ...] = (0.0, 0.5, 1.0)
    #: Standard deviation of the logarithm of the scale, the factor between all
    #: perceived forces and the true ones; 0 where it is known to be one. None for what
    #: the sensor's data sheet says.
    scale_error: float | None = None
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
        if self.scale_error is not None:
            expect_between("scale_error", self.scale_error, 0.0, 3.0)
        for name, value, words in (
            ("memory", {self.memory}, get_args(Memory)),
            ("sharing", self.sharing, get_args(Sharing)),
            ("overnight", {self.overnight}, get_args(Overnight)),
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

    @property
    def failures_overnight(self) -> bool:
        """Whether failed pushes are remembered on the next day of a mission."""
        return self.memory != "none" and self.overnight != "nothing"

    @property
    def belief_overnight(self) -> bool:
        """Whether beliefs are remembered on the next day of a mission."""
        return self.memory == "belief" and self.overnight == "belief"

    def calls_for_replanning(self, change_l1: float) -> bool:
        """Whether |b' - b|_1 > epsilon_b (paper II.H)."""
        return self.replan_on_belief and change_l1 > self.threshold
