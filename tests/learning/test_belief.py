"""The posterior over worlds against counting, and against the DP's own chances."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beacon_mj.learning import DoorPart, DoorProblem, world_posterior
from tests.learning.problems import PROBLEMS, TWO_KINDS, Atoms


def by_counting(part: DoorPart, outcomes: dict[int, bool]) -> list[float] | None:
    """P(world | outcomes) from the list of everything that nature may draw."""
    chances = []
    for w in range(len(part.weights)):
        one = DoorPart(stages=part.stages, weights=(1.0,), opens=(part.opens[w],))
        atoms = Atoms(one)
        fits = [all(r[d] == o for d, o in outcomes.items()) for r in atoms.opens]
        chances.append(part.weights[w] * float(atoms.chance @ np.array(fits)))
    total = sum(chances)
    return [c / total for c in chances] if total > 0.0 else None


@settings(max_examples=300)
@given(PROBLEMS, st.data())
def test_the_posterior_is_that_of_counting(
    case: DoorProblem, data: st.DataObject
) -> None:
    (part,) = case.parts
    doors = range(len(part.opens[0]))
    tried = data.draw(st.lists(st.sampled_from(doors), unique=True))
    outcomes = {d: data.draw(st.booleans()) for d in tried}
    found, expected = world_posterior(part, outcomes), by_counting(part, outcomes)
    if expected is None:
        assert found is None
    else:
        assert found is not None
        assert found.tolist() == pytest.approx(expected, abs=1e-9)


def test_what_the_prior_rules_out_is_said() -> None:
    (part,) = TWO_KINDS.parts
    assert world_posterior(part, {0: True, 2: False}) is None
    told = world_posterior(part, {0: True})
    assert told is not None
    assert told.tolist() == [1.0, 0.0]
