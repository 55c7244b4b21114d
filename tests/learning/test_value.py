"""The exact value of learning against an enumeration of all policies."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beacon_mj.errors import SceneError
from beacon_mj.geometry import Array
from beacon_mj.learning import (
    DoorPart,
    DoorProblem,
    DoorStage,
    memoryless_s,
    updating_s,
)
from beacon_mj.learning.policy import realized_s
from tests.learning.problems import PROBLEMS, Atoms, kinds_problem, loads_problem


def trees(
    problem: DoorProblem, part: DoorPart, atoms: Atoms, memory: bool
) -> list[Array]:
    """The times of every policy in every atom, by building every policy tree."""
    if memory:
        return subtrees(problem, part, atoms, 0, None, frozenset())
    orders = [list(itertools.permutations(range(len(s.doors)))) for s in part.stages]
    return [
        sum(
            (
                np.array([order_time(problem, s, o, row) for row in atoms.opens])
                for s, o in zip(part.stages, plan, strict=True)
            ),
            np.zeros(len(atoms.chance)),
        )
        for plan in itertools.product(*orders)
    ]


def order_time(
    problem: DoorProblem, stage: DoorStage, order: tuple[int, ...], row: Array
) -> float:
    t, at = 0.0, None
    for i in order:
        t += stage.enter_s[i] if at is None else stage.between_s[at][i]
        if row[stage.doors[i]]:
            return t + problem.pass_s + stage.cross_s[i]
        t, at = t + problem.fail_s, i
    raise AssertionError("a dead end")


def subtrees(
    problem: DoorProblem,
    part: DoorPart,
    atoms: Atoms,
    b: int,
    at: int | None,
    failed: frozenset[int],
) -> list[Array]:
    """All policy trees from one place on; each branches on what a push shows."""
    if b == len(part.stages):
        return [np.zeros(len(atoms.chance))]
    stage, out = part.stages[b], []
    through = subtrees(problem, part, atoms, b + 1, None, frozenset())
    for i in set(range(len(stage.doors))) - failed:
        go = stage.enter_s[i] if at is None else stage.between_s[at][i]
        opened = atoms.opens[:, stage.doors[i]]
        passed = [problem.pass_s + stage.cross_s[i] + t for t in through]
        last = len(failed) + 1 == len(stage.doors)
        others = (
            [np.zeros(len(opened))]  # Never reached: one door always opens.
            if last
            else subtrees(problem, part, atoms, b, i, failed | {i})
        )
        out += [
            go + np.where(opened, yes, problem.fail_s + no)
            for yes in passed
            for no in others
        ]
    return out


def brute(problem: DoorProblem, memory: bool) -> float:
    total = 0.0
    for part in problem.parts:
        atoms = Atoms(part)
        times = np.array(trees(problem, part, atoms, memory))
        total += float((times @ atoms.chance).min())
    return total


@settings(max_examples=1000)
@given(PROBLEMS)
def test_both_optima_equal_those_of_all_policy_trees(case: DoorProblem) -> None:
    updating, memoryless = updating_s(case), memoryless_s(case)
    assert updating == pytest.approx(brute(case, memory=True), abs=1e-9)
    assert memoryless == pytest.approx(brute(case, memory=False), abs=1e-9)
    assert updating <= memoryless + 1e-9


@given(PROBLEMS)
def test_the_policy_takes_its_expected_time_on_average(case: DoorProblem) -> None:
    (part,) = case.parts
    atoms = Atoms(part)
    for updating, expected in ((True, updating_s(case)), (False, memoryless_s(case))):
        taken = [realized_s(case, [row], updating=updating) for row in atoms.opens]
        assert float(atoms.chance @ taken) == pytest.approx(expected, abs=1e-9)


@given(st.one_of(kinds_problem(), loads_problem()))
def test_one_stage_teaches_nothing(case: DoorProblem) -> None:
    (part,) = case.parts
    alone = tuple(
        DoorPart(stages=(s,), weights=part.weights, opens=part.opens)
        for s in part.stages
    )
    apart = DoorProblem(parts=alone, fail_s=case.fail_s, pass_s=case.pass_s)
    assert updating_s(apart) == pytest.approx(memoryless_s(apart), abs=1e-12)
    assert memoryless_s(apart) == pytest.approx(memoryless_s(case), abs=1e-12)


def test_a_hand_calculation() -> None:
    """Two stages, two kinds of which one opens: the second stage is then free of doubt.

    Without memory each stage costs 1 + (0.5 * 0.7) + 0.5 * (2 + 1 + 0.7) = 3.2 s; with
    it the second costs 1 + 0.7 s.
    """
    both = tuple(
        DoorStage(
            doors=doors,
            enter_s=(1.0, 1.0),
            between_s=((0.0, 1.0), (1.0, 0.0)),
            cross_s=(0.0, 0.0),
        )
        for doors in ((0, 1), (2, 3))
    )
    part = DoorPart(
        stages=both,
        weights=(0.5, 0.5),
        opens=((1.0, 0.0, 1.0, 0.0), (0.0, 1.0, 0.0, 1.0)),
    )
    case = DoorProblem(parts=(part,), fail_s=2.0, pass_s=0.7)
    assert memoryless_s(case) == pytest.approx(6.4, abs=1e-12)
    assert updating_s(case) == pytest.approx(3.2 + 1.7, abs=1e-12)


ONE = DoorStage(doors=(0,), enter_s=(1.0,), between_s=((0.0,),), cross_s=(1.0,))


def test_what_is_no_problem_is_refused() -> None:
    with pytest.raises(
        SceneError, match=r"a door of \(0,\) that may open in every world"
    ):
        DoorPart(stages=(ONE,), weights=(1.0,), opens=((0.0,),))
    with pytest.raises(SceneError, match="positive weights with sum 1"):
        DoorPart(stages=(ONE,), weights=(0.5,), opens=((1.0,),))
    with pytest.raises(SceneError, match="one weight per world"):
        DoorPart(stages=(ONE,), weights=(0.5, 0.5), opens=((1.0,),))
    with pytest.raises(SceneError, match="1 times to enter"):
        DoorStage(doors=(0,), enter_s=(), between_s=((0.0,),), cross_s=(1.0,))
    two = DoorStage(
        doors=(0, 1),
        enter_s=(1.0, 1.0),
        between_s=((0.0, 0.0), (0.0, 0.0)),
        cross_s=(1.0, 1.0),
    )
    with pytest.raises(SceneError, match="all doors in common or none"):
        DoorPart(stages=(ONE, two), weights=(1.0,), opens=((1.0, 1.0),))
