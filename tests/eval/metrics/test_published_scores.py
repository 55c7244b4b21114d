"""Properties of the published scores."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from beacon_mj.eval.metrics import published_scores as scores

LENGTHS = st.floats(0.01, 100.0)
AMOUNTS = st.floats(0.0, 1e4)


@given(LENGTHS, LENGTHS)
def test_spl_is_a_share(reference_m: float, path_m: float) -> None:
    score = scores.spl(True, reference_m, path_m)
    assert 0.0 < score <= 1.0
    assert scores.spl(False, reference_m, path_m) == 0.0
    assert scores.spl(True, reference_m, reference_m) == 1.0
    assert scores.spl(True, reference_m, 2.0 * path_m) <= score


@given(LENGTHS, LENGTHS)
def test_bench_push_efficiency_is_spl_where_the_path_is_longer(
    reference_m: float, extra_m: float
) -> None:
    path_m = reference_m + extra_m
    assert scores.bench_push_efficiency(True, reference_m, path_m) == pytest.approx(
        scores.spl(True, reference_m, path_m)
    )


@given(LENGTHS, AMOUNTS, AMOUNTS)
def test_disturbance_only_lowers_scores(
    path_m: float, less: float, more: float
) -> None:
    less, more = sorted((less, more))
    assert scores.kinematic_score(10.0, path_m, more) <= scores.kinematic_score(
        10.0, path_m, less
    )
    assert scores.dynamic_score(10.0, path_m, more) <= scores.dynamic_score(
        10.0, path_m, less
    )
    assert scores.kinematic_score(10.0, path_m, 0.0) == 1.0
    assert scores.dynamic_score(10.0, path_m, 0.0) == 1.0


def test_values_worked_out_by_hand() -> None:
    assert scores.kinematic_score(10.0, 5.0, 50.0) == 0.5
    assert scores.dynamic_score(10.0, 10.0, 981.0) == pytest.approx(0.5)
    assert scores.ins(0.8, 0.5, 0.5) == pytest.approx(0.65)
    assert scores.bench_push_effort(10.0, 3.0, 10.0) == 0.75
    assert scores.kinematic_score(10.0, 0.0, 0.0) == 1.0
    assert scores.dynamic_score(10.0, 0.0, 0.0) == 1.0
    assert scores.bench_push_efficiency(True, 4.0, 0.0) == 0.0
