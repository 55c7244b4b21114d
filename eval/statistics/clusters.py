"""Rows that are not independent: the days of one mission are one observation.

A mission shares one room and one memory, so intervals and tests take missions as their
units. Where no row is of a mission, every scene is a unit of its own.
"""

from collections.abc import Iterable, Sequence
from typing import Protocol


class Clustered(Protocol):
    """A row that says what is independent of others."""

    @property
    def mission(self) -> int | None:
        """The mission that it belongs to; None outside missions."""

    @property
    def unit(self) -> str:
        """The scene, or the mission."""


def clusters_of(rows: Iterable[Clustered]) -> list[str] | None:
    """Return the unit of each row; None if no two rows are of one mission."""
    found = [*rows]
    units = [row.unit for row in found]
    shared = len({*units}) < len(units) and any(r.mission is not None for r in found)
    return units if shared else None


def totals(values: Sequence[float], clusters: Sequence[str]) -> list[float]:
    """Return the sum of the values of each cluster, in order of first appearance."""
    sums: dict[str, float] = {}
    for value, name in zip(values, clusters, strict=True):
        sums[name] = sums.get(name, 0) + value
    return [*sums.values()]


def sign_flip_test(differences: Sequence[int]) -> float:
    """Return the two-sided p-value of the exact sign-flip test.

    If neither arm is better, each unit's difference d_k is as likely as -d_k:

        p = P(|sum_k s_k d_k| >= |sum_k d_k|),  s_k = +-1 with probability 1/2 each,

    over all 2^n signs. With differences of -1, 0 and 1 it is McNemar's exact test.
    Fisher, "The Design of Experiments", 1935, section 21.

    Args:
        differences: One whole number a unit.
    """
    ways = {0: 1}  # Number of signs that lead to each sum.
    for d in differences:
        after: dict[int, int] = {}
        for total, count in ways.items():
            for step in (d, -d):
                after[total + step] = after.get(total + step, 0) + count
        ways = after
    seen = abs(sum(differences))
    extreme = sum(count for total, count in ways.items() if abs(total) >= seen)
    return float(extreme / 2 ** len(differences))
