"""Push or go round: the comparison, and what a log says of it."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from beacon_mj.motion.detour import FreeRoute
from beacon_mj.planners.contact.candidates import PushPlan

Terms = Mapping[str, float]
MOST_OPTIONS = 3  #: Obstacles whose pushes are compared in one decision.


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """Push or detour, and what was compared.

    Attributes:
        plan: The push, None for the detour.
        cost_push: What was compared of the best push, in the policy's own unit: for the
            rule of `decide`, C_push - bonus; infinite for none.
        cost_detour: The same of the way round: C_detour + margin; infinite if there is
            none. The lower of the two was chosen.
        terms: Named terms of the cost of what was chosen, for the log.
        reason: One short sentence, for the log.
    """

    plan: PushPlan | None
    cost_push: float
    cost_detour: float
    terms: Terms
    reason: str


def compared(decision: Decision | None) -> dict[str, Any]:
    """Return what was compared, as the fields of `PlannerInfo` that say so."""
    if decision is None:
        return {}
    return {
        "cost_push": decision.cost_push,
        "cost_detour": decision.cost_detour,
        "terms": decision.terms,
    }


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
    push, detour = c_push - bonus, c_detour + margin
    of_push, of_detour = _sum(c_push, -bonus), _sum(c_detour, margin)
    if plan is not None and push < detour:
        reason = f"Push: {of_push}, less than {of_detour} for the way round."
        return Decision(plan, push, detour, terms, reason)
    reason = f"Go round: {of_detour}, not more than {of_push} for the push."
    return Decision(None, push, detour, way or {}, reason)


def _sum(cost: float, term: float) -> str:
    """Return a side of the comparison in words, with what it is the sum of."""
    if term == 0.0 or math.isinf(cost):
        return f"{cost:.2f}"
    sign = "-" if term < 0.0 else "+"
    return f"{cost + term:.2f} ({cost:.2f} {sign} {abs(term):.2f})"


def decide_in_turn(
    options: Iterator[list[PushPlan]],
    detour: FreeRoute,
    compare: Callable[[list[PushPlan]], Decision],
) -> Decision | None:
    """Compare the pushes of a few obstacles at a time until there is a way to go on.

    Args:
        options: The pushes of each obstacle that may be pushed, best way first.
        detour: The way round; where there is one, the first comparison decides.
        compare: Chooses among the pushes of `MOST_OPTIONS` obstacles and the detour.

    Returns:
        The last decision, None if there is no push at all.
    """
    decision = None
    while plans := [plan for few in islice(options, MOST_OPTIONS) for plan in few]:
        decision = compare(plans)
        if decision.plan is not None or detour.path is not None:
            break
    return decision
