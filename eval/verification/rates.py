"""Rates that are claimed against rates that were found, with their intervals."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from beacon_mj.eval.metrics.row import Row
from beacon_mj.eval.statistics.intervals import mean_interval, wilson_interval

RATES = ("success", "clean_success")
#: Coverage of the interval of a difference that counts as a failure: honest results
#: on two seeds differ too, and a run has many planners.
CONFIDENCE = 0.999


class Estimate(NamedTuple):
    """A mean with its 95 % interval; NaN ends over too few scenes."""

    mean: float
    low: float
    high: float


class FreshResult(NamedTuple):
    """What one planner claims, and what it does on fresh scenes.

    Attributes:
        planner: Its name.
        column: `success`, `clean_success` or `steps`.
        claimed: Over the scenes of the run.
        fresh: Over the fresh scenes.
        consistent: Whether a difference of rates of this size may be chance (99.9 %).
    """

    planner: str
    column: str
    claimed: Estimate
    fresh: Estimate
    consistent: bool

    def __str__(self) -> str:
        """Return one line."""
        return self.told("on fresh scenes")

    def told(self, where: str) -> str:
        """Return one line that says where the planner was run."""
        found, claimed = (_text(self.column, e) for e in (self.fresh, self.claimed))
        return f"{self.planner}: {self.column} {found} {where}, {claimed} claimed"


def rate_results(claimed: Sequence[Row], fresh: Sequence[Row]) -> list[FreshResult]:
    """Return what planners claim and what they do, a line a planner and column."""
    out = []
    for planner in dict.fromkeys(row.planner for row in fresh):
        ours, theirs = (
            [row for row in rows if row.planner == planner] for rows in (claimed, fresh)
        )
        if not ours:
            continue
        out += [_rate(planner, name, ours, theirs) for name in RATES]
        claim, mean = (_mean([float(r.steps) for r in rows]) for rows in (ours, theirs))
        out.append(FreshResult(planner, "steps", claim, mean, True))
    return out


def _rate(
    planner: str, column: str, claimed: Sequence[Row], fresh: Sequence[Row]
) -> FreshResult:
    counts = [
        (sum(bool(getattr(row, column)) for row in rows), len(rows))
        for rows in (claimed, fresh)
    ]
    claim, rate = (Estimate(k / n, *wilson_interval(k, n)) for k, n in counts)
    return FreshResult(planner, column, claim, rate, _consistent(*counts))


def _consistent(claimed: tuple[int, int], fresh: tuple[int, int]) -> bool:
    """Whether the claimed rate is not above the fresh one by more than chance.

    Newcombe's score interval of the difference of two independent rates (1998, method
    10): d - sqrt((p1 - l1)^2 + (u2 - p2)^2), with Wilson's intervals (l, u) of each.
    """
    (k1, n1), (k2, n2) = claimed, fresh
    l1, _ = wilson_interval(k1, n1, CONFIDENCE)
    _, u2 = wilson_interval(k2, n2, CONFIDENCE)
    p1, p2 = k1 / n1, k2 / n2
    spread = math.sqrt((p1 - l1) ** 2 + (u2 - p2) ** 2)
    return p1 - p2 - spread <= 0.0


def _mean(values: Sequence[float]) -> Estimate:
    return Estimate(*mean_interval(values))


def _text(column: str, found: Estimate) -> str:
    scale, unit = (100.0, " %") if column in RATES else (1.0, "")
    mean, low, high = (scale * value for value in found)
    return f"{mean:.1f}{unit} [{low:.1f}, {high:.1f}]"
