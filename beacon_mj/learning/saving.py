"""What learning saves in one actual world: both optimal policies, driven through it.

The value of learning is an expectation over the prior. In an actual world w the same
two policies take times of their own, and

    saving(w) = T_memoryless(w) - T_updating(w),   E_w[saving(w)] = value of learning.

It can be negative: what was learned may mislead. It needs the truth, so only an
evaluation computes it; no scene stores or promises it.
"""

from collections.abc import Sequence
from typing import NamedTuple

from beacon_mj.learning.policy import realized_s
from beacon_mj.learning.problem import DoorProblem


class ActualSaving(NamedTuple):
    """Times of the two optimal policies in one actual world [s].

    Attributes:
        memoryless_s: Of the best policy that carries nothing from stage to stage.
        updating_s: Of the best of all policies.
    """

    memoryless_s: float
    updating_s: float

    @property
    def saving_s(self) -> float:
        """What learning saves in this world [s]."""
        return self.memoryless_s - self.updating_s


def actual_saving(
    problem: DoorProblem, outcomes: Sequence[Sequence[bool]]
) -> ActualSaving:
    """Return how long both optimal policies take where doors open as given.

    Args:
        problem: Stages, travel times and prior.
        outcomes: Whether each door opens, by part and number.
    """
    return ActualSaving(
        memoryless_s=realized_s(problem, outcomes, updating=False),
        updating_s=realized_s(problem, outcomes, updating=True),
    )
