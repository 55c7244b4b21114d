"""The statistics of the tables: intervals, paired tests, and robust summaries.

scipy.stats takes a third of a second to import, so it is imported where it is used.
"""

from collections.abc import Sequence
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from beacon_mj.eval.statistics.bootstrap import bca_intervals
from beacon_mj.eval.statistics.clusters import sign_flip_test, totals
from beacon_mj.geometry import Array


class Interval(NamedTuple):
    """An estimate and its interval; NaN ends where no interval can be given."""

    estimate: float
    low: float
    high: float


def wilson_interval(
    count: float, n: int, confidence: float = 0.95
) -> tuple[float, float]:
    """Return the Wilson score interval of a rate.

        (p + z^2/2n -+ z sqrt(p (1 - p)/n + z^2/4n^2)) / (1 + z^2/n),  p = count / n

    Wilson, "Probable inference, the law of succession, and statistical inference",
    1927.

    Args:
        count: Successes, 0 <= count <= n.
        n: Trials, >= 1.
        confidence: Coverage, in (0, 1).
    """
    if not 0 <= count <= n or n < 1:
        raise ValueError(f"Expected 0 <= count <= n, n >= 1 but it was {count} of {n}.")
    z = NormalDist().inv_cdf(0.5 + confidence / 2.0)
    p, q = count / n, z * z / n
    middle = p + q / 2.0
    half = z * np.sqrt(p * (1.0 - p) / n + q / (4.0 * n))
    low, high = float((middle - half) / (1.0 + q)), float((middle + half) / (1.0 + q))
    # The ends are exact at no and at all successes; rounding must not lose that.
    return (0.0 if count == 0 else low), (1.0 if count == n else high)


def rate_interval(
    flags: Sequence[bool], clusters: Sequence[str] | None = None
) -> tuple[float, float]:
    """Return the Wilson interval of a rate, of as many trials as there are clusters.

    Values of one cluster then count as one, as if they were always alike: the interval
    is never too narrow, and says something where all of them agree.

    Args:
        flags: One value an episode, at least one.
        clusters: The scene or mission of each; None if every value has its own.
    """
    count, n = sum(flags), len(flags)
    units = n if clusters is None else len({*clusters})
    return wilson_interval(units * count / n, units)


def mcnemar(
    first: Sequence[bool],
    second: Sequence[bool],
    clusters: Sequence[str] | None = None,
) -> float:
    """Return the two-sided p-value of McNemar's exact test.

    Of the b + c pairs in which the two differ, b is Binomial(b + c, 1/2) if neither is
    better: p = min(1, 2 P(X <= min(b, c))). McNemar 1947; exact form Liddell 1983.

    Args:
        first: Success of one planner, scene by scene.
        second: Success of the other on the same scenes.
        clusters: The mission of each scene; None if every scene is on its own. With
            clusters it is the exact sign-flip test over their differences.
    """
    _check_paired(len(first), len(second))
    if clusters is not None:
        gains = [int(x) - int(y) for x, y in zip(first, second, strict=True)]
        return sign_flip_test([round(d) for d in totals(gains, clusters)])
    b = sum(x and not y for x, y in zip(first, second, strict=True))
    c = sum(y and not x for x, y in zip(first, second, strict=True))
    if b + c == 0:
        return 1.0
    from scipy.stats import binomtest

    return float(binomtest(b, b + c, 0.5).pvalue)


def paired_rate_interval(
    first: Sequence[bool],
    second: Sequence[bool],
    confidence: float = 0.95,
    clusters: Sequence[str] | None = None,
) -> Interval:
    """Return the difference of two rates over the same scenes, and its interval.

        p1 - p2 - sqrt((p1 - l1)^2 - 2 phi (p1 - l1)(u2 - p2) + (u2 - p2)^2)
        p1 - p2 + sqrt((u1 - p1)^2 - 2 phi (u1 - p1)(p2 - l2) + (p2 - l2)^2)

    with the Wilson intervals (l, u) of both rates, and phi their correlation with a
    continuity correction: method 10 of Newcombe, "Improved confidence intervals for
    the difference between binomial proportions based on paired data", 1998. Unlike a
    bootstrap it says something when no scene, or every scene, differs. With clusters,
    the scenes of one count as one, as in `rate_interval`.
    """
    _check_paired(len(first), len(second))
    if len(first) == 0:
        return Interval(np.nan, np.nan, np.nan)
    n = len(first) if clusters is None else len({*clusters})
    pairs = [*zip(map(bool, first), map(bool, second), strict=True)]
    x, y, both = (
        n * sum(counted) / len(pairs)
        for counted in zip(*((a, b, a and b) for a, b in pairs), strict=True)
    )
    (l1, u1), (l2, u2) = (wilson_interval(k, n, confidence) for k in (x, y))
    p1, p2, phi = x / n, y / n, _correlation(both, x, y, n)
    low = _spread(p1 - l1, u2 - p2, phi)
    high = _spread(u1 - p1, p2 - l2, phi)
    return Interval(p1 - p2, p1 - p2 - low, p1 - p2 + high)


def _correlation(both: float, x: float, y: float, n: int) -> float:
    """Return Newcombe's phi of a 2 x 2 table; 0 where a margin is empty."""
    margins = x * (n - x) * y * (n - y)
    if margins == 0:
        return 0.0
    excess = float(both * (n - x - y + both) - (x - both) * (y - both))
    if excess > 0.0:
        excess = max(excess - n / 2.0, 0.0)
    return excess / float(np.sqrt(float(margins)))


def _spread(a: float, b: float, phi: float) -> float:
    return float(np.sqrt(max(a * a - 2.0 * phi * a * b + b * b, 0.0)))


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p-values adjusted for their number, in the order given.

    p'_(i) = max_{j <= i} min(1, (m - j + 1) p_(j)). Holm, "A simple sequentially
    rejective multiple test procedure", 1979.
    """
    adjusted, largest = [0.0] * len(p_values), 0.0
    for rank, k in enumerate(sorted(range(len(p_values)), key=p_values.__getitem__)):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[k]))
        adjusted[k] = largest
    return adjusted


def mean_interval(
    values: Sequence[float],
    clusters: Sequence[str] | None = None,
    confidence: float = 0.95,
    seed: int = 0,
) -> Interval:
    """Return the mean and its BCa bootstrap interval, resampled by cluster.

    See `bca_intervals`. Episodes of one scene are alike, so whole scenes are drawn: an
    interval that ignores that is too narrow.

    Args:
        values: One value an episode.
        clusters: The scene or mission of each value; None if every value has its own.
        confidence: Coverage, in (0, 1).
        seed: Seed of the resampling; the same input gives the same interval.
    """
    data = np.asarray(values, dtype=float)
    if len(data) == 0:
        return Interval(np.nan, np.nan, np.nan)
    names = range(len(data)) if clusters is None else clusters
    _check_paired(len(data), len(names))
    _, which = np.unique(np.asarray(names), return_inverse=True)
    sums, counts = np.zeros((2, which.max() + 1))
    np.add.at(sums, which, data)
    np.add.at(counts, which, 1.0)
    [[low, high]] = bca_intervals(sums[:, None], counts[:, None], confidence, seed)
    return Interval(float(sums.sum() / counts.sum()), float(low), float(high))


def paired_interval(
    first: Sequence[float],
    second: Sequence[float],
    clusters: Sequence[str] | None = None,
    confidence: float = 0.95,
    seed: int = 0,
) -> Interval:
    """Return the mean of `first - second` over the same scenes, and its BCa interval.

    Args:
        first: One planner's values, scene by scene.
        second: The other's, on the same scenes in the same order.
        clusters: See `mean_interval`.
        confidence: Coverage, in (0, 1).
        seed: Seed of the resampling.
    """
    _check_paired(len(first), len(second))
    difference = np.asarray(first, dtype=float) - np.asarray(second, dtype=float)
    return mean_interval(list(difference), clusters, confidence, seed)


def correlation_interval(
    first: Sequence[float], second: Sequence[float], confidence: float = 0.95
) -> Interval:
    """Return Pearson's correlation of paired values, and Fisher's interval.

        r = tanh(z),  z -+ z_c / sqrt(n - 3),  mapped back by tanh

    Fisher, "On the probable error of a coefficient of correlation deduced from a small
    sample", 1921. It takes the pairs for independent and about normal.

    Args:
        first: One value a pair.
        second: The other.
        confidence: Coverage, in (0, 1).

    Returns:
        NaN where a side does not vary; no ends for fewer than four pairs, and the
        estimate twice where all pairs lie on a line.
    """
    _check_paired(len(first), len(second))
    x, y = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if len(x) < 2 or _constant(x) or _constant(y):
        return Interval(np.nan, np.nan, np.nan)
    dx, dy = x - x.mean(), y - y.mean()
    norm = np.sqrt((dx * dx).sum()) * np.sqrt((dy * dy).sum())
    r = float(np.clip((dx * dy).sum() / norm, -1.0, 1.0))
    if len(x) < 4:
        return Interval(r, np.nan, np.nan)
    if abs(r) > 1.0 - 1e-12:
        return Interval(r, r, r)
    half = NormalDist().inv_cdf(0.5 + confidence / 2.0) / np.sqrt(len(x) - 3.0)
    low, high = (float(np.tanh(np.arctanh(r) + s * half)) for s in (-1.0, 1.0))
    return Interval(r, low, high)


def rank_correlation_interval(
    first: Sequence[float], second: Sequence[float], confidence: float = 0.95
) -> Interval:
    """Return Spearman's rank correlation of paired values, and Fisher's interval.

    It is `correlation_interval` of their ranks, equal values sharing the mean of
    theirs; Spearman, "The proof and measurement of association between two things",
    1904.
    """
    from scipy.stats import rankdata

    ranks = [[float(r) for r in rankdata(values)] for values in (first, second)]
    return correlation_interval(ranks[0], ranks[1], confidence)


def _constant(values: Array) -> bool:
    return bool(np.ptp(values) <= 1e-9 * max(1.0, float(np.abs(values).max())))


def interquartile_mean(values: Sequence[float]) -> float:
    """Return the mean of the middle half of the values; NaN of none.

    A quarter of n that is no whole number is rounded down at both ends, as
    `scipy.stats.trim_mean` does. Agarwal et al., "Deep Reinforcement Learning at the
    Edge of the Statistical Precipice", 2021.
    """
    data = np.sort(np.asarray(values, dtype=float))
    cut = len(data) // 4
    middle = data[cut : len(data) - cut]
    return float(middle.mean()) if len(middle) else float("nan")


def probability_of_improvement(
    first: Sequence[float], second: Sequence[float]
) -> float:
    """Return P(X > Y) + P(X = Y) / 2 over all pairs; NaN if either is empty.

    Mann and Whitney's U over the number of pairs; Agarwal et al. 2021.
    """
    x, y = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    if len(x) == 0 or len(y) == 0:
        return float("nan")
    above = x[:, None] > y[None, :]
    equal = x[:, None] == y[None, :]
    return float(above.mean() + 0.5 * equal.mean())


def _check_paired(first: int, second: int) -> None:
    if first != second:
        raise ValueError(
            f"Expected paired values of equal number but it was {first} and {second}."
        )
