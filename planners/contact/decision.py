"""Push or go round: the comparison, and what a log says of it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from beacon_mj.planners.contact.candidates import PushPlan

Terms = Mapping[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """Push or detour, and what was compared; `plan` is None for the detour."""

    plan: PushPlan | None
    cost_push: float
    cost_detour: float
    terms: Terms
    reason: str


def decide(
    pushes: Sequence[tuple[Terms, PushPlan]],
    way: Terms | None,
    *,
    bonus: float = 0.0,
    margin: float = 0.0,
) -> Decision:
    """Push if C_push - bonus < C_detour + margin (paper II.F).

    Args:
        pushes: Terms of J of every push that is allowed; the costs are their sums.
        way: Those of the way round, None if there is none.
        bonus: Bonus of pushing (b_push).
        margin: Margin of the detour (m_detour); a larger one favours pushing.
    """
    terms, plan = min(
        pushes, key=lambda push: math.fsum(push[0].values()), default=({}, None)
    )
    c_push = math.inf if plan is None else math.fsum(terms.values())
    c_detour = math.inf if way is None else math.fsum(way.values())
    if plan is not None and c_push - bonus < c_detour + margin:
        reason = f"Push: {c_push:.2f} against {c_detour:.2f} for the way round."
        return Decision(plan, c_push, c_detour, terms, reason)
    reason = f"Go round: {c_detour:.2f} against {c_push:.2f} for the push."
    return Decision(None, c_push, c_detour, way or {}, reason)
