"""Every row of the fidelity table passes, and a failing world would be noticed."""

import math

import pytest

from beacon_mj.errors import RunError
from beacon_mj.fidelity import CHECKS, Law, run_fidelity
from beacon_mj.fidelity.impact import measured_peak_n, reference_peak_n
from beacon_mj.scene_gen.generate import generate_scene


@pytest.mark.parametrize("check", CHECKS)
def test_the_shipped_worlds_pass(check: str) -> None:
    rows = run_fidelity([check])
    assert rows
    assert {row.check for row in rows} == {check}
    assert not [row for row in rows if not row.passed]


def test_every_free_obstacle_has_its_breakaway_row() -> None:
    free = [o.id for o in generate_scene("cluttered", 0).obstacles if not o.fixed]
    laws = " ".join(row.law for row in run_fidelity(["breakaway"]))
    assert len(free) > 10
    assert all(f" {name} " in laws for name in free)


def test_an_unknown_check_lists_what_exists() -> None:
    with pytest.raises(RunError, match=r"Unknown fidelity check 'crep'.*'creep'"):
        run_fidelity(["crep"])


@pytest.mark.parametrize(
    ("measured", "passed"), [(1.0, True), (1.1, True), (1.2, False), (math.nan, False)]
)
def test_a_row_passes_within_its_tolerance(measured: float, passed: bool) -> None:
    row = Law(check="x", law="y", expected=1.0, measured=measured, tolerance=0.11)
    assert row.passed is passed


@pytest.mark.parametrize("mass", [0.5, 5.0, 50.0])
def test_impact_approaches_its_equations_as_the_step_shrinks(mass: float) -> None:
    expected = reference_peak_n(mass, 0.4, driven=False)
    errors = [
        abs(measured_peak_n(mass, 0.4, driven=False, timestep_s=dt) / expected - 1.0)
        for dt in (0.002, 0.0005)
    ]
    assert errors[1] < 0.65 * errors[0] < 0.1
    bound = 0.4 * math.sqrt(5000.0 / (1.0 / 10.0 + 1.0 / mass))
    assert 0.25 * bound < expected < bound
