"""Paired comparison of two arms: differences with intervals, overall and per family.

A difference is `first - baseline`, scene by scene. Nothing is dropped in silence:
costs are compared on the scenes that both solved, with how many these are, and over
all scenes beside it.
"""

import math
from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.statistics.bootstrap import bca_intervals
from beacon_mj.eval.statistics.clusters import clusters_of
from beacon_mj.eval.statistics.grouping import OVERALL, groups
from beacon_mj.eval.statistics.intervals import holm, mcnemar, paired_rate_interval
from beacon_mj.eval.statistics.missions import (
    MissionRow,
    mission_row,
    whole_missions,
)
from beacon_mj.eval.statistics.pairing import Matched
from beacon_mj.eval.statistics.summary import RATES
from beacon_mj.geometry import Array

#: Compared columns; smaller is better in all of them.
COSTS = (
    "path_length_m",
    "steps",
    "energy_j",
    "energy_rolling_j",
    "contacts",
    "obstacles_broken",
    "filtered_peak_force_n",
)


Pair = tuple[Row, Row] | tuple[MissionRow, MissionRow]  #: (first, baseline).


class Difference(msgspec.Struct, frozen=True, kw_only=True):
    """A mean paired difference.

    Attributes:
        n: Scenes behind it.
        first: Mean of the arm that is judged; None over no scene.
        baseline: Mean of the other.
        estimate: first - baseline.
        low: Lower end of the 95 % interval; None over fewer than two scenes.
        high: Upper end.
    """

    n: int
    first: float | None
    baseline: float | None
    estimate: float | None
    low: float | None
    high: float | None


class Rate(msgspec.Struct, frozen=True, kw_only=True):
    """A paired difference of rates.

    Attributes:
        difference: With Newcombe's paired score interval.
        only_first: Scenes on which only the judged arm succeeded.
        only_baseline: Scenes on which only the baseline did.
        p_value: McNemar's exact test, two-sided.
    """

    difference: Difference
    only_first: int
    only_baseline: int
    p_value: float


class Improvement(msgspec.Struct, frozen=True, kw_only=True):
    """P(first better) + P(equal) / 2 over scenes; a failure is worse than any success.

    Agarwal et al. 2021 with every scene a task. 1/2 means that neither is better.

    Attributes:
        n: Scenes behind it.
        probability: In [0, 1].
        low: Lower end of the 95 % interval; None over fewer than two scenes.
        high: Upper end.
    """

    n: int
    probability: float
    low: float | None
    high: float | None


class Cost(msgspec.Struct, frozen=True, kw_only=True):
    """Paired differences of one column, with BCa intervals by scene or mission.

    Attributes:
        solved: On scenes that both solved.
        all: Over all scenes.
        improvement: Probability that the judged arm does better on a scene.
    """

    solved: Difference
    all: Difference
    improvement: Improvement


class FamilyComparison(msgspec.Struct, frozen=True, kw_only=True):
    """One family, a suite, or all: scenes, rates by name and costs by column."""

    family: str
    scenes: int
    rates: dict[str, Rate]
    costs: dict[str, Cost]


class Comparison(msgspec.Struct, frozen=True, kw_only=True):
    """Two arms compared.

    Attributes:
        first: Label of the arm that is judged.
        baseline: Label of the other.
        first_oracle: Whether the judged planner was told the truth.
        baseline_oracle: Whether the other one was.
        left_out: Scenes that only one of them has.
        p_holm: McNemar's p-value of overall success, adjusted by Holm's procedure
            for the number of comparisons made together.
        cells: Overall, then per family, and per suite where there are several.
        missions: The same of whole missions: sums over their days, on the missions that
            both have all days of; empty for runs without missions.
    """

    first: str
    baseline: str
    first_oracle: bool = False
    baseline_oracle: bool = False
    left_out: int
    p_holm: float
    cells: dict[str, FamilyComparison]
    missions: dict[str, FamilyComparison] = {}


def compare_pairs(matched: Sequence[Matched]) -> list[Comparison]:
    """Return the comparisons of pairs of arms."""
    made = [_comparison(pair) for pair in matched]
    raw = [c.cells[OVERALL].rates["success"].p_value for c in made]
    return [
        msgspec.structs.replace(c, p_holm=p)
        for c, p in zip(made, holm(raw), strict=True)
    ]


def _comparison(matched: Matched) -> Comparison:
    found = groups(matched.pairs, lambda pair: pair[1])
    missions = _missions(matched.pairs)
    return Comparison(
        first=matched.first,
        baseline=matched.baseline,
        first_oracle=any(row.oracle for row, _ in matched.pairs),
        baseline_oracle=any(row.oracle for _, row in matched.pairs),
        left_out=matched.left_out,
        p_holm=1.0,
        cells={name: _cell(name, own) for name, own in found.items()},
        missions=_by_family(missions) if missions else {},
    )


def _missions(pairs: Sequence[tuple[Row, Row]]) -> list[tuple[MissionRow, MissionRow]]:
    """Return pairs of whole missions."""
    arms = ([pair[k] for pair in pairs] for k in (0, 1))
    first, base = (
        {m.unit: m for m in map(mission_row, whole_missions(rows))} for rows in arms
    )
    return [(first[unit], base[unit]) for unit in base if unit in first]


def _by_family(
    pairs: Sequence[tuple[MissionRow, MissionRow]],
) -> dict[str, FamilyComparison]:
    families = dict.fromkeys(base.family for _, base in pairs)
    return {OVERALL: _cell(OVERALL, pairs)} | {
        name: _cell(name, [p for p in pairs if p[1].family == name])
        for name in families
    }


def _cell(family: str, pairs: Sequence[Pair]) -> FamilyComparison:
    return FamilyComparison(
        family=family,
        scenes=len(pairs),
        rates={name: _rate(pairs, name) for name in RATES},
        costs=_costs(pairs),
    )


def _rate(pairs: Sequence[Pair], name: str) -> Rate:
    first, base = ([bool(getattr(p[k], name)) for p in pairs] for k in (0, 1))
    clusters = clusters_of(row for _, row in pairs)
    estimate, low, high = paired_rate_interval(first, base, clusters=clusters)
    n = len(pairs)
    return Rate(
        difference=Difference(
            n=n,
            first=sum(first) / n,
            baseline=sum(base) / n,
            estimate=estimate,
            low=low,
            high=high,
        ),
        only_first=sum(x and not y for x, y in zip(first, base, strict=True)),
        only_baseline=sum(y and not x for x, y in zip(first, base, strict=True)),
        p_value=mcnemar(first, base, clusters),
    )


def _costs(pairs: Sequence[Pair]) -> dict[str, Cost]:
    values = np.array(
        [[[float(getattr(row, c)) for c in COSTS] for row in p] for p in pairs]
    )
    first, base = values[:, 0], values[:, 1]
    won = np.array([[row.success for row in p] for p in pairs])
    units = [row.unit for _, row in pairs]
    solved = _differences(first, base, np.all(won, axis=1), units)
    everywhere = _differences(first, base, np.ones(len(pairs), bool), units)
    improvement = _improvements(first, base, won, units)
    return {
        name: Cost(solved=solved[j], all=everywhere[j], improvement=improvement[j])
        for j, name in enumerate(COSTS)
    }


def _differences(
    first: Array, base: Array, used: NDArray[np.bool_], units: Sequence[str]
) -> list[Difference]:
    """Return each column's mean difference over the scenes that are used.

    Args:
        first: The judged arm's values, shape (scenes, columns).
        base: The baseline's.
        used: Which scenes count, shape (scenes,).
        units: The scene or mission of each.
    """
    n = int(used.sum())
    difference = (first - base)[used]
    ends = _ends(
        difference, [u for u, counts in zip(units, used, strict=True) if counts]
    )
    return [
        Difference(
            n=n,
            first=float(first[used, j].mean()) if n else None,
            baseline=float(base[used, j].mean()) if n else None,
            estimate=float(difference[:, j].mean()) if n else None,
            low=_finite(ends[j, 0]),
            high=_finite(ends[j, 1]),
        )
        for j in range(first.shape[1])
    ]


def _improvements(
    first: Array, base: Array, won: NDArray[np.bool_], units: Sequence[str]
) -> list[Improvement]:
    """Return each column's probability of improvement; `won` has shape (scenes, 2)."""
    x, y = (np.where(won[:, k, None], v, np.inf) for k, v in enumerate((first, base)))
    better = (x < y) + 0.5 * (x == y)
    ends = _ends(better, units)
    return [
        Improvement(
            n=len(better),
            probability=float(better[:, j].mean()),
            low=_finite(ends[j, 0]),
            high=_finite(ends[j, 1]),
        )
        for j in range(better.shape[1])
    ]


def _ends(values: Array, units: Sequence[str]) -> Array:
    """Return the ends of every column's interval; a unit is a cluster of rows."""
    if len(values) == 0:
        return np.full((values.shape[1], 2), np.nan)
    known = {unit: k for k, unit in enumerate(dict.fromkeys(units))}
    which = [known[unit] for unit in units]
    sums, counts = np.zeros((2, len(known), values.shape[1]))
    np.add.at(sums, which, values)
    np.add.at(counts, which, 1.0)
    return bca_intervals(sums, counts)


def _finite(value: float) -> float | None:
    return None if math.isnan(value) else float(value)
