"""Cascades as printed (paper II.D, II.G), on cases computed by hand."""

import math
from collections.abc import Iterable

import numpy as np
import pytest

from beacon_mj.geometry import Array
from beacon_mj.pushing.cascade import Cascade, cascade

EAST = np.array([1.0, 0.0])
#: Who stands how far behind whom [m]: 0 before 1 before 2.
GAPS = {0: [(1, 0.1)], 1: [(2, 0.05)], 2: []}


def sweep(i: int, travel: Array) -> Iterable[tuple[int, float]]:
    return [(j, gap) for j, gap in GAPS[i] if gap < float(np.linalg.norm(travel))]


def pushed(forces: list[float], travel_m: float, *, alone: bool) -> Cascade:
    return cascade(
        0, travel_m * EAST, sweep, lambda i: forces[i], 60.0,
        lambda i: math.isinf(forces[i]), graze_m=0.0, each_alone=alone,
    )  # fmt: skip


def test_travel_shrinks_by_every_gap() -> None:
    found = pushed([10.0, 10.0, 10.0], 0.3, alone=True)
    assert [i for i, _ in found.moved] == [0, 1, 2]
    assert [d for _, d in found.moved] == pytest.approx([0.3, 0.2, 0.15])
    assert found.links == ((0, 1), (1, 2))
    assert found.feasible
    assert math.isinf(found.room_m)


def test_each_link_is_compared_alone_as_printed_or_all_together() -> None:
    """Three of 25 N: each is within 60 N, together they are 75 N."""
    assert pushed([25.0, 25.0, 25.0], 0.3, alone=True).feasible
    together = pushed([25.0, 25.0, 25.0], 0.3, alone=False)
    assert together.blocked_by == 2
    assert together.force_n == 75.0


@pytest.mark.parametrize(
    ("forces", "blocked", "room_m"),
    [
        ([61.0, 1.0, 1.0], 0, 0.0),
        ([1.0, 61.0, 1.0], 1, 0.1),
        ([1.0, 1.0, math.inf], 2, 0.15),
        ([60.0, 60.0, 60.0], None, math.inf),
    ],
)
def test_the_chain_ends_at_the_first_infeasible_link(
    forces: list[float], blocked: int | None, room_m: float
) -> None:
    found = pushed(forces, 0.3, alone=True)
    assert found.blocked_by == blocked
    assert found.room_m == pytest.approx(room_m)


def test_nothing_is_met_within_the_gap() -> None:
    assert [i for i, _ in pushed([1.0, 1.0, 1.0], 0.1, alone=True).moved] == [0]
