"""The best policy with and without memory across stages, exactly.

The updating optimum is a dynamic programme over what is known,

    V(b, d, F, e) = min_i t(d, i) + P_i (t_pass + t_cross(i) + V(b + 1, entry, {}, e_i))
                                  + (1 - P_i) (t_fail + V(b, i, F + {i}, e)),

with stage b, place d (the entry or before a door), doors F that failed in this stage,
and evidence e of earlier stages; e_i adds what stage b showed. P_i is the exact
posterior probability that door i opens:

    P_i = sum_w v_w q_wF p_wi / sum_w v_w q_wF (1 - prod_{j not in F} (1 - p_wj)),

v_w the weight of world w after e over the probability that the stage is no dead end,
p_wi its probability that i opens, q_wF the product of 1 - p_wj over F. The last factor
of the denominator is the promise that a stage is no dead end. Evidence enters as counts
of doors that are alike in all worlds, since their order does not matter.

The memoryless optimum is the best of all policies that carry no evidence from one stage
to another. Stages then decouple, and since every observation before the last one of a
stage is a failure, the best policy in a stage is a fixed order of its doors.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.learning.problem import DoorPart, DoorProblem, DoorStage
from beacon_mj.numerics import dot

#: What is known of doors: sorted (number or class of it, whether it opened, count).
Evidence = tuple[tuple[int, bool, int], ...]
ENTRY = -1  #: The place before the first decision of a stage.


def updating_s(problem: DoorProblem) -> float:
    """Return the least expected time of all policies, which may learn [s]."""
    return math.fsum(
        PartPolicy(part, problem.fail_s, problem.pass_s).expected_s
        for part in problem.parts
    )


def memoryless_s(problem: DoorProblem) -> float:
    """Return the least expected time without memory across stages [s]."""
    return math.fsum(
        PartPolicy(alone, problem.fail_s, problem.pass_s).expected_s
        for alone in _single_stages(problem)
    )


def realized_s(
    problem: DoorProblem, outcomes: Sequence[Sequence[bool]], *, updating: bool
) -> float:
    """Return the time that an optimal policy takes in one actual world [s].

    Args:
        problem: The problem.
        outcomes: Whether each door opens, by part and number.
        updating: Whether the policy learns from stage to stage.
    """
    total = 0.0
    for part, opens in zip(problem.parts, outcomes, strict=True):
        whole = [part] if updating else [_single_stage(part, s) for s in part.stages]
        for each in whole:
            total += _policy(each, problem.fail_s, problem.pass_s).time_in(opens)
    return total


@lru_cache(maxsize=64)
def _policy(part: DoorPart, fail_s: float, pass_s: float) -> "PartPolicy":
    """Return the optimal policy of a part, which many actual worlds share."""
    return PartPolicy(part, fail_s, pass_s)


def _single_stages(problem: DoorProblem) -> list[DoorPart]:
    return [_single_stage(part, s) for part in problem.parts for s in part.stages]


def _single_stage(part: DoorPart, stage: DoorStage) -> DoorPart:
    return DoorPart(stages=(stage,), weights=part.weights, opens=part.opens)


@dataclass(slots=True)
class PartPolicy:
    """The optimal policy of one part.

    Attributes:
        part: Its stages and prior.
        fail_s: Time lost by a push that fails [s].
        pass_s: Time lost by a push that works [s].
    """

    part: DoorPart
    fail_s: float
    pass_s: float
    _opens: Array = field(init=False, repr=False)
    _class: dict[int, int] = field(init=False, repr=False)
    _sure: set[int] = field(init=False, repr=False)
    _best: Callable[..., tuple[float, int]] = field(init=False, repr=False)
    _options: Callable[..., list[tuple[int, float, float]]] = field(
        init=False, repr=False
    )
    _worlds: Callable[..., Array] = field(init=False, repr=False)
    _shut: Callable[..., tuple[Array, Array]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Sort the doors into classes, and prepare the memory of the recursion."""
        self._opens = np.array(self.part.opens, dtype=float)
        self._class, self._sure = _classes(self.part, self._opens)
        self._best = lru_cache(maxsize=None)(self._decide)
        self._options = lru_cache(maxsize=None)(self._weigh_options)
        self._worlds = lru_cache(maxsize=None)(self._weigh)
        self._shut = lru_cache(maxsize=None)(self._shut_doors)

    @property
    def expected_s(self) -> float:
        """Expected time of the policy under the prior [s]."""
        return self._best(0, ENTRY, frozenset(), ())[0]

    def choose(
        self, stage: int, at: int, failed: frozenset[int], known: Evidence
    ) -> int:
        """Return which door of a stage to try next, as its place in `stage.doors`."""
        return self._best(stage, at, failed, known)[1]

    def expected_from(
        self, stage: int, at: int, failed: frozenset[int], known: Evidence
    ) -> float:
        """Return the expected time from a place of a stage to the part's end [s]."""
        return self._best(stage, at, failed, known)[0]

    def evidence(self, outcomes: Mapping[int, bool]) -> Evidence:
        """Return as evidence how doors of stages before the present one ended.

        Args:
            outcomes: Whether each door that was tried opened, by its number.
        """
        counts: dict[tuple[int, bool], int] = {}
        for door, opened in outcomes.items():
            self._count(counts, door, opened)
        return tuple(sorted((*key, count) for key, count in counts.items()))

    def time_in(self, opens: Sequence[bool]) -> float:
        """Return the time that the policy takes where doors open as given [s]."""
        total = 0.0
        known: Evidence = ()
        for b, stage in enumerate(self.part.stages):
            at, failed, passed = ENTRY, frozenset[int](), False
            while not passed:
                i = self.choose(b, at, failed, known)
                total += stage.enter_s[i] if at == ENTRY else stage.between_s[at][i]
                passed = bool(opens[stage.doors[i]])
                if not passed:
                    total += self.fail_s
                    at, failed = i, failed | {i}
            total += self.pass_s + stage.cross_s[i]
            known = self._after(b, failed, i, known)
        return total

    def _decide(
        self, b: int, at: int, failed: frozenset[int], known: Evidence
    ) -> tuple[float, int]:
        """Return the expected time to the end, and the door to try."""
        if b == len(self.part.stages):
            return 0.0, ENTRY
        stage = self.part.stages[b]
        best = (math.inf, ENTRY)
        for i, chance, passed_s in self._options(b, failed, known):
            t = stage.enter_s[i] if at == ENTRY else stage.between_s[at][i]
            t += chance * passed_s
            if chance < 1.0:
                again = self._best(b, i, failed | {i}, known)[0]
                t += (1.0 - chance) * (self.fail_s + again)
            best = min(best, (t, i))
        return best

    def _weigh_options(
        self, b: int, failed: frozenset[int], known: Evidence
    ) -> list[tuple[int, float, float]]:
        """Return doors left to try, their chances, and the time if each opens."""
        out = []
        for i, chance in self._chances(b, failed, known):
            passed_s = 0.0
            if chance > 0.0:
                after = self._after(b, failed, i, known)
                rest = self._best(b + 1, ENTRY, frozenset(), after)[0]
                passed_s = self.pass_s + self.part.stages[b].cross_s[i] + rest
            out.append((i, chance, passed_s))
        return out

    def _chances(
        self, b: int, failed: frozenset[int], known: Evidence
    ) -> list[tuple[int, float]]:
        """Return the doors left to try, and with what probability each opens."""
        doors = self.part.stages[b].doors
        told = {door: float(opened) for door, opened, _ in known if door >= 0}
        doubted = [i for i in failed if doors[i] not in told]
        stuck, passable = self._shut(b, frozenset(doubted))
        weight = self._worlds(b, known) * stuck
        if not self._crossed(b):
            total = dot(weight, passable)
        else:
            total = float(weight.sum())
        chances = [dot(weight, self._opens[:, d]) / total for d in doors]
        out = []
        for i, door in enumerate(doors):
            if i not in failed:
                chance = told.get(door, chances[i])
                # Of a single door left, rounding must not leave a doubt.
                out.append((i, 1.0 if chance > 1.0 - 1e-14 else chance))
        return out

    def _shut_doors(self, b: int, failed: frozenset[int]) -> tuple[Array, Array]:
        """Return q_wF, and the probability that one of the other doors opens, (w,)."""
        shut = 1.0 - self._opens[:, self.part.stages[b].doors]
        others = [i for i in range(shut.shape[1]) if i not in failed]
        stuck = shut[:, sorted(failed)].prod(axis=1)
        return stuck, 1.0 - shut[:, others].prod(axis=1)

    def _crossed(self, b: int) -> bool:
        """Whether the doors of stage b were met before, one of which opened then."""
        doors = set(self.part.stages[b].doors)
        return any(doors == set(s.doors) for s in self.part.stages[:b])

    def _weigh(self, b: int, known: Evidence) -> Array:
        """Return the weights of worlds after the evidence of stages before b, (w,).

        They are divided by the probability that none of the stages up to b is a dead
        end, which doors that are drawn on their own do not know of.
        """
        weight = np.array(self.part.weights)
        for door, opened, count in known:
            p = self._opens[:, door if door >= 0 else -1 - door]
            likelihood = p if opened else 1.0 - p
            for _ in range(count):
                weight = weight * likelihood
        for doors in {frozenset(s.doors) for s in self.part.stages[: b + 1]}:
            shut = np.prod([1.0 - self._opens[:, d] for d in doors], axis=0)
            weight = weight / (1.0 - shut)
        return np.asarray(weight / weight.max())

    def _after(
        self, b: int, failed: frozenset[int], opened: int, known: Evidence
    ) -> Evidence:
        """Return the evidence after a stage in which `opened` let the robot through."""
        doors = self.part.stages[b].doors
        counts = {(door, result): count for door, result, count in known}
        for i in (*failed, opened):
            self._count(counts, doors[i], i == opened)
        return tuple(sorted((*key, count) for key, count in counts.items()))

    def _count(
        self, counts: dict[tuple[int, bool], int], door: int, opened: bool
    ) -> None:
        """Count how one door ended; of some, one alike says all there is to say."""
        key = self._class[door], opened
        counts[key] = 1 if key[0] in self._sure else counts.get(key, 0) + 1


def _classes(part: DoorPart, opens: Array) -> tuple[dict[int, int], set[int]]:
    """Return the class of each door, and the classes that say all at the first try.

    Doors that are met once, and are alike in all worlds, share a class: -1 minus the
    number of the first of them. One that is met again is known by its own number.
    """
    first: dict[bytes, int] = {}
    classes: dict[int, int] = {}
    sure: set[int] = set()
    for stage in part.stages:
        for d in stage.doors:
            column = opens[:, d]
            again = [d in s.doors for s in part.stages].count(True) > 1
            name = d if again else -1 - first.setdefault(column.tobytes(), d)
            classes[d] = name
            if again or bool(np.isin(column, (0.0, 1.0)).all()):
                sure.add(name)
    return classes, sure
