"""Statistics against published and hand-computed values."""

import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, bootstrap, mannwhitneyu, pearsonr, trim_mean

from beacon_mj.eval.statistics.intervals import (
    correlation_interval,
    holm,
    interquartile_mean,
    mcnemar,
    mean_interval,
    paired_interval,
    paired_rate_interval,
    probability_of_improvement,
    wilson_interval,
)
from beacon_mj.geometry import Array


@pytest.mark.parametrize(
    ("count", "n", "low", "high"),
    [
        # Newcombe, Statistics in Medicine 17 (1998), table I, method 3.
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0000, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_equals_newcombes_table(
    count: int, n: int, low: float, high: float
) -> None:
    assert wilson_interval(count, n) == pytest.approx((low, high), abs=5e-5)


@given(st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_equals_scipys(pair: tuple[int, int]) -> None:
    theirs = binomtest(*pair).proportion_ci(method="wilson")
    assert wilson_interval(*pair) == pytest.approx(tuple(theirs), abs=1e-12)


def test_wilson_refuses_impossible_counts() -> None:
    with pytest.raises(ValueError, match="Expected 0 <= count <= n"):
        wilson_interval(3, 2)
    with pytest.raises(ValueError, match="0 of 0"):
        wilson_interval(0, 0)


def discordant(b: int, c: int, both: int = 10) -> tuple[list[bool], list[bool]]:
    first = [True] * b + [False] * c + [True] * both
    second = [False] * b + [True] * c + [True] * both
    return first, second


def test_mcnemar_equals_the_binomial_sum() -> None:
    # 2 * (C(9,0) + C(9,1) + C(9,2)) / 2^9 with b = 2, c = 7.
    assert mcnemar(*discordant(2, 7)) == pytest.approx(2 * 46 / 512)
    assert mcnemar(*discordant(7, 2)) == pytest.approx(2 * 46 / 512)
    assert mcnemar(*discordant(0, 6)) == pytest.approx(2 / 64)
    assert mcnemar(*discordant(3, 3)) == 1.0
    assert mcnemar(*discordant(0, 0)) == 1.0


def test_mcnemar_ignores_pairs_that_agree() -> None:
    assert mcnemar(*discordant(2, 7, both=0)) == mcnemar(*discordant(2, 7, both=99))


def test_mcnemar_refuses_unpaired_values() -> None:
    with pytest.raises(ValueError, match="paired values of equal number"):
        mcnemar([True], [True, False])


def test_mean_interval_equals_scipys_bca() -> None:
    values = np.random.default_rng(5).exponential(size=60)
    ours = mean_interval(list(values))
    theirs = bootstrap(
        (values,), np.mean, n_resamples=30000, method="BCa", rng=1
    ).confidence_interval
    assert ours.estimate == pytest.approx(values.mean())
    width = theirs.high - theirs.low
    assert ours.low == pytest.approx(theirs.low, abs=0.03 * width)
    assert ours.high == pytest.approx(theirs.high, abs=0.03 * width)


def test_intervals_are_repeatable() -> None:
    values = [1.0, 2.0, 4.0, 8.0, 16.0]
    assert mean_interval(values, seed=3) == mean_interval(values, seed=3)
    assert mean_interval(values, seed=3) != mean_interval(values, seed=4)


def test_clusters_widen_the_interval() -> None:
    rng = np.random.default_rng(2)
    scenes = rng.normal(size=30)
    values = list(np.repeat(scenes, 10) + 0.01 * rng.normal(size=300))
    names = [str(k) for k in np.repeat(np.arange(30), 10)]
    alone, clustered = mean_interval(values), mean_interval(values, names)
    assert alone.estimate == pytest.approx(clustered.estimate)
    ratio = (clustered.high - clustered.low) / (alone.high - alone.low)
    # Ten equal episodes a scene carry the information of one: sqrt(10) wider.
    assert ratio == pytest.approx(math.sqrt(10.0), rel=0.15)


def test_clusters_of_unequal_size_keep_the_mean() -> None:
    values, names = [1.0, 1.0, 1.0, 5.0], ["s", "s", "s", "t"]
    assert mean_interval(values, names).estimate == 2.0


def test_paired_interval_removes_what_scenes_share() -> None:
    rng = np.random.default_rng(0)
    scenes = 100.0 * rng.normal(size=80)
    first, second = scenes + 1.0 + 0.1 * rng.normal(size=80), scenes
    found = paired_interval(list(first), list(second))
    assert 0.9 < found.low < found.estimate < found.high < 1.1


def test_intervals_of_too_little() -> None:
    assert math.isnan(mean_interval([]).estimate)
    one = mean_interval([3.0])
    assert one.estimate == 3.0
    assert math.isnan(one.low)
    assert mean_interval([2.0, 2.0, 2.0]) == (2.0, 2.0, 2.0)


def paired_data(rng: np.random.Generator, scenes: int) -> tuple[Array, Array]:
    """Return path lengths of two planners that share how hard a scene is.

    The true mean difference is 0.5: gamma noise of mean 1 each, and 0.5.
    """
    hard = rng.gamma(2.0, 3.0, size=scenes)
    noise = rng.gamma(2.0, 0.5, size=(2, scenes))
    return hard + noise[0] + 0.5, hard + noise[1]


def trial_hits(clustered: bool) -> tuple[int, int]:
    rng = np.random.default_rng(7)
    hits, trials = 0, 1000
    for trial in range(trials):
        first, second = paired_data(rng, 100)
        names = None
        if clustered:  # Three episodes a scene, which share the scene's difference.
            own = 0.1 * rng.normal(size=(2, 300))
            first, second = np.repeat(first, 3) + own[0], np.repeat(second, 3) + own[1]
            names = [str(k) for k in np.repeat(np.arange(100), 3)]
        found = paired_interval([*first], [*second], names, seed=trial)
        hits += found.low <= 0.5 <= found.high
    return hits, trials


@pytest.mark.slow
@pytest.mark.parametrize("clustered", [False, True])
def test_coverage_of_the_paired_interval(clustered: bool) -> None:
    hits, trials = trial_hits(clustered)
    assert 0.93 <= hits / trials <= 0.97


@pytest.mark.slow
def test_coverage_of_the_paired_interval_of_rates() -> None:
    rng = np.random.default_rng(8)
    hits, trials = 0, 4000
    for _ in range(trials):
        hard = rng.random(100) < 0.3  # Both fail; else each succeeds on its own.
        first, second = ~hard & (rng.random((2, 100)) < [[0.9], [0.7]])
        found = paired_rate_interval([*first], [*second])
        hits += found.low <= 0.7 * 0.2 <= found.high
    assert 0.93 <= hits / trials <= 0.97


def test_paired_rates_equal_newcombes_table() -> None:
    # Newcombe, Statistics in Medicine 17 (1998), 2635-2650: 36, 12, 2, 0; method 10.
    first, second = discordant(12, 2, both=36)
    found = paired_rate_interval(first, second)
    assert found == pytest.approx((0.2, 0.0569, 0.3404), abs=5e-5)


@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=60))
def test_paired_rates_turn_with_the_arms(pairs: list[tuple[bool, bool]]) -> None:
    first, second = [a for a, _ in pairs], [b for _, b in pairs]
    there, back = (
        paired_rate_interval(first, second),
        paired_rate_interval(second, first),
    )
    assert there == pytest.approx((-back.estimate, -back.high, -back.low))
    assert -1.0 - 1e-9 <= there.low <= there.estimate <= there.high <= 1.0 + 1e-9


def test_paired_rates_of_nothing() -> None:
    assert math.isnan(paired_rate_interval([], []).low)


def test_holm_on_paper() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.7, 0.9]) == [1.0, 1.0]
    assert holm([]) == []


def test_interquartile_mean() -> None:
    assert interquartile_mean([0.0, 1.0, 2.0, 100.0]) == 1.5
    assert interquartile_mean(range(8)) == 3.5
    assert math.isnan(interquartile_mean([]))


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=40))
def test_interquartile_mean_equals_scipys(values: list[float]) -> None:
    assert interquartile_mean(values) == pytest.approx(trim_mean(values, 0.25))


def test_probability_of_improvement() -> None:
    assert probability_of_improvement([1.0, 3.0], [0.0, 2.0]) == 0.75
    assert probability_of_improvement([1.0], [1.0]) == 0.5
    assert math.isnan(probability_of_improvement([], [1.0]))


@given(
    st.lists(st.integers(0, 5), min_size=1, max_size=20),
    st.lists(st.integers(0, 5), min_size=1, max_size=20),
)
def test_probability_of_improvement_is_mann_whitneys(
    x: list[int], y: list[int]
) -> None:
    u = mannwhitneyu(x, y, method="asymptotic").statistic / (len(x) * len(y))
    assert probability_of_improvement(x, y) == pytest.approx(u)
    both = probability_of_improvement(x, y) + probability_of_improvement(y, x)
    assert both == pytest.approx(1.0)


def test_scipy_is_imported_only_when_used() -> None:
    code = (
        "import sys; from beacon_mj.eval.statistics.intervals import wilson_interval; "
        "wilson_interval(1, 2); assert 'scipy.stats' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@given(st.integers(0, 2**32 - 1), st.integers(4, 60))
def test_a_correlation_is_scipys_with_fishers_interval(seed: int, n: int) -> None:
    x, noise = np.random.default_rng(seed).normal(size=(2, n))
    y = 0.6 * x + noise
    theirs = pearsonr(x, y)
    low, high = theirs.confidence_interval(0.95)
    found = correlation_interval([*x], [*y])
    assert found == pytest.approx((theirs.statistic, low, high), abs=1e-9)


def test_a_correlation_of_too_little_is_none() -> None:
    flat = correlation_interval([1.0, 2.0, 3.0, 4.0], [5.0] * 4)
    assert all(math.isnan(value) for value in flat)
    three = correlation_interval([1.0, 2.0, 3.0], [2.0, 1.0, 3.0])
    assert three.estimate == pytest.approx(0.5)
    assert math.isnan(three.low)
    assert correlation_interval([1.0, 2.0, 3.0, 5.0], [2.0, 4.0, 6.0, 10.0]) == (
        1,
        1,
        1,
    )
    with pytest.raises(ValueError, match="paired"):
        correlation_interval([1.0], [])
