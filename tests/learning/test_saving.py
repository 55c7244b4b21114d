"""What learning saves in an actual world: the laws that it must obey."""

import pytest
from hypothesis import given, settings

from beacon_mj.learning import (
    DoorProblem,
    actual_saving,
    memoryless_s,
    updating_s,
)
from tests.learning.problems import PROBLEMS, Atoms


@settings(max_examples=1000)
@given(PROBLEMS)
def test_actual_savings_average_to_the_value_of_learning(case: DoorProblem) -> None:
    (part,) = case.parts
    atoms = Atoms(part)
    saved = [actual_saving(case, [row]).saving_s for row in atoms.opens]
    value = memoryless_s(case) - updating_s(case)
    assert float(atoms.chance @ saved) == pytest.approx(value, abs=1e-9)


@given(PROBLEMS)
def test_parts_add_up(case: DoorProblem) -> None:
    (part,) = case.parts
    row = [bool(v) for v in Atoms(part).opens[0]]
    both = DoorProblem(parts=(part, part), fail_s=case.fail_s, pass_s=case.pass_s)
    once, twice = actual_saving(case, [row]), actual_saving(both, [row, row])
    assert twice.memoryless_s == pytest.approx(2.0 * once.memoryless_s, abs=1e-9)
    assert twice.updating_s == pytest.approx(2.0 * once.updating_s, abs=1e-9)
