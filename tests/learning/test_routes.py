"""Optimism and hindsight on the route graph, by hand and against the optimum."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.learning import (
    ENTRY,
    DoorPart,
    DoorProblem,
    PartPolicy,
    hindsight_s,
    optimistic_s,
    updating_s,
)
from tests.learning.problems import PROBLEMS, TWO_KINDS, Atoms, stage_of

SAMPLES = 60


def drive(
    case: DoorProblem, opens: list[bool], *, hindsight: bool, seed: int = 0
) -> float:
    """Time of one of the two policies in one actual world."""
    (part,) = case.parts
    rng = np.random.default_rng(seed)
    outcomes: dict[int, bool] = {}
    total = 0.0
    for b, stage in enumerate(part.stages):
        at, failed = (
            ENTRY,
            {i for i, d in enumerate(stage.doors) if outcomes.get(d) is False},
        )
        while True:
            if hindsight:
                q = hindsight_s(
                    case, part, b, at, failed, outcomes, samples=SAMPLES, rng=rng
                )
            else:
                q = optimistic_s(stage, at, failed)
            i = min(q, key=q.__getitem__)
            total += stage.enter_s[i] if at == ENTRY else stage.between_s[at][i]
            outcomes[stage.doors[i]] = opens[stage.doors[i]]
            if opens[stage.doors[i]]:
                total += case.pass_s + stage.cross_s[i]
                break
            total, at, failed = total + case.fail_s, i, failed | {i}
    return total


@given(PROBLEMS, st.booleans())
def test_neither_beats_the_optimum(case: DoorProblem, hindsight: bool) -> None:
    (part,) = case.parts
    atoms = Atoms(part)
    taken = [
        drive(case, [bool(v) for v in row], hindsight=hindsight) for row in atoms.opens
    ]
    assert float(atoms.chance @ taken) >= updating_s(case) - 1e-9


def test_hindsight_is_the_mean_over_worlds() -> None:
    """Door 0 opens in half of the worlds, else door 1, whose way is 1 s longer.

    Q(0) = 1 + (0.7 + 0) / 2 + (2 + 1 + 0.7 + 1) / 2 and Q(1) = 1 + the mean of the
    same with doors swapped: 0.7 + 1 or 2 + 1 + 0.7.
    """
    stage = stage_of((0, 1), cross_s=(0.0, 1.0))
    part = DoorPart(stages=(stage,), weights=(0.5, 0.5), opens=((1.0, 0.0), (0.0, 1.0)))
    case = DoorProblem(parts=(part,), fail_s=2.0, pass_s=0.7)
    q = hindsight_s(
        case, part, 0, ENTRY, set(), {}, samples=20_000, rng=np.random.default_rng(3)
    )
    assert q[0] == pytest.approx(1.0 + 0.5 * 0.7 + 0.5 * 4.7, abs=0.06)
    assert q[1] == pytest.approx(1.0 + 0.5 * 1.7 + 0.5 * 3.7, abs=0.06)


def test_hindsight_uses_what_was_seen() -> None:
    (part,) = TWO_KINDS.parts
    told = {0: False, 1: True}
    rng = np.random.default_rng(0)
    q = hindsight_s(TWO_KINDS, part, 1, ENTRY, set(), told, samples=5, rng=rng)
    assert min(q, key=q.__getitem__) == 1
    assert q[1] == pytest.approx(1.0 + 0.7)
    assert (
        hindsight_s(
            TWO_KINDS, part, 1, ENTRY, set(), {0: True, 1: True}, samples=5, rng=rng
        )
        == {}
    )


def test_optimism_does_not() -> None:
    (part,) = TWO_KINDS.parts
    q = optimistic_s(part.stages[1], ENTRY, set())
    assert q == {0: 1.0, 1: 1.0}
    assert optimistic_s(part.stages[1], 0, {0}) == {1: 1.0}


def test_only_the_optimum_pays_for_what_later_stages_gain() -> None:
    """A sure door against one that is 0.2 s dearer in expectation and tells the kind.

    Three later stages ask for the kind again, so the optimum tries it; hindsight, which
    takes every sampled world for known, does not.
    """
    case = probing()
    (part,) = case.parts
    policy = PartPolicy(part, case.fail_s, case.pass_s)
    assert policy.choose(0, ENTRY, frozenset(), ()) == 1
    q = hindsight_s(
        case, part, 0, ENTRY, set(), {}, samples=20_000, rng=np.random.default_rng(1)
    )
    assert min(q, key=q.__getitem__) == 0
    assert math.isfinite(q[1])


def probing() -> DoorProblem:
    """Stage 0 has a sure door 0 and a door 1 of kind A; stages 1-3 kinds A and B."""
    first = stage_of((0, 1), enter_s=(2.3, 1.0))
    rest = tuple(stage_of((d, d + 1)) for d in (2, 4, 6))
    part = DoorPart(
        stages=(first, *rest),
        weights=(0.5, 0.5),
        opens=(
            (1.0, 1.0, *(1.0, 0.0) * 3),
            (1.0, 0.0, *(0.0, 1.0) * 3),
        ),
    )
    return DoorProblem(parts=(part,), fail_s=2.0, pass_s=0.7)
