"""Chain reactions of a push (paper II.G): who moves, how far, and what stops it.

When O_i is displaced into O_j, O_j is displaced by what is left of the travel, if the
force model allows it (paper II.D); the cascade O_i -> O_j -> O_k ends where the next
obstacle is infeasible or nothing more is met. All of them travel along one direction.
Forces in [N], lengths in [m].
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from beacon_mj.geometry import Array
from beacon_mj.numerics import norm

#: Of an obstacle that travels by a vector (2,) [m]: (index, gap [m]) of all that it
#: would sweep into, the nearest first.
Sweep = Callable[[int, Array], Iterable[tuple[int, float]]]


@dataclass(frozen=True, slots=True)
class Cascade:
    """What a push would set in motion.

    Attributes:
        moved: Index and travel [m] of every obstacle that would move, in order.
        force_n: Sum of the breakaway forces of all of them [N]: a row of n bodies
            needs n times the force of one.
        blocked_by: Index of the obstacle that makes the push infeasible, if any.
        room_m: How far the first may travel before that one is met [m].
        links: Who pushes whom beyond the first: (index, index) of every obstacle that
            is met, the one that blocks included.
    """

    moved: tuple[tuple[int, float], ...]
    force_n: float
    blocked_by: int | None
    room_m: float = math.inf
    links: tuple[tuple[int, int], ...] = ()

    @property
    def feasible(self) -> bool:
        """Whether the whole cascade gives way."""
        return self.blocked_by is None


def cascade(
    first: int,
    travel: Array,
    sweep: Sweep,
    force: Callable[[int], float],
    force_max_n: float,
    fixed: Callable[[int], bool],
    *,
    graze_m: float,
    each_alone: bool = False,
) -> Cascade:
    """Predict what moves when obstacle `first` is pushed by `travel` (paper II.G).

    Args:
        first: Index of the pushed obstacle.
        travel: Its displacement, shape (2,) [m].
        sweep: Whom an obstacle would sweep into.
        force: Breakaway force of an obstacle by index [N].
        force_max_n: What the robot can apply [N].
        fixed: Whether an obstacle is known not to give way.
        graze_m: Overlap up to which what is met does not count as hit [m].
        each_alone: Compare the force of each link alone with `force_max_n`, as
            printed; else those of all bodies ahead of the robot add up.

    Returns:
        The cascade; it stops at the first obstacle that cannot be moved.
    """
    distance = norm(travel)
    direction = travel / max(distance, 1e-12)
    reach = {first: distance}
    queue, total = [first], 0.0
    order: list[tuple[int, float]] = []
    links: list[tuple[int, int]] = []
    while queue:
        i = queue.pop(0)
        total += force(i)
        needed = force(i) if each_alone else total
        if fixed(i) or needed > force_max_n:
            room_m = distance - reach[i]
            return Cascade(tuple(order), total, i, room_m, tuple(links))
        order.append((i, reach[i]))
        for j, gap in sweep(i, direction * reach[i]):
            if j not in reach and reach[i] - gap > graze_m:
                reach[j] = reach[i] - gap
                queue.append(j)
                links.append((i, j))
    return Cascade(tuple(order), total, None, links=tuple(links))
