"""How far footprints travel until they touch, against shapely."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from beacon_mj.geometry import Footprint, Footprints
from beacon_mj.pushing.sweeps import travel_gaps

SQUARE = np.array([(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)])
SHAPES = (
    Footprint(SQUARE),
    Footprint(np.array([(0.0, 0.25), (-0.2, -0.1), (0.2, -0.1)])),
    Footprint(np.zeros((1, 2)), 0.15),
    Footprint(np.array([(-0.15, 0.0), (0.15, 0.0)]), 0.08),
)


def gap(mover: Footprint, other: Footprint, heading: float) -> float:
    both, out = Footprints.stack([mover, other]), np.empty(2)
    ux, uy = math.cos(heading), math.sin(heading)
    travel_gaps(0, ux, uy, both.vertices, both.radius, out)
    assert math.isinf(out[0])
    return float(out[1])


@given(
    st.sampled_from(SHAPES), st.sampled_from(SHAPES),
    st.floats(0.7, 1.5), st.floats(0.0, 6.28), st.floats(0.0, 6.28),
    st.floats(-0.4, 0.4),
)  # fmt: skip
def test_after_the_gap_they_touch_and_not_before(
    mover: Footprint,
    other: Footprint,
    apart: float,
    bearing: float,
    yaw: float,
    aside: float,
) -> None:
    far = other.moved(apart * math.cos(bearing), apart * math.sin(bearing), yaw)
    heading = bearing + aside
    step = np.array([math.cos(heading), math.sin(heading)])
    found = gap(mover, far, heading)
    target = far.polygon()
    if math.isinf(found):
        ends = [mover.shifted(t * step).polygon() for t in np.linspace(0.0, 3.0, 301)]
        assert min(p.distance(target) for p in ends) >= 0.0
        assert max(p.intersection(target).area for p in ends) < 1e-4
        return
    touching = mover.shifted(found * step).polygon()
    # Arcs are inscribed polygons in shapely, with 0.05 mm of sagitta each.
    assert touching.distance(target) < 2e-4
    before = mover.shifted((found - 0.01) * step).polygon()
    assert before.distance(target) > 0.0


@pytest.mark.parametrize("aside", [0.0, 0.1, 0.399])
def test_square_on_square_is_exact(aside: float) -> None:
    other = Footprint(SQUARE + np.array([1.0, aside]))
    assert gap(SHAPES[0], other, 0.0) == pytest.approx(0.6, abs=1e-12)


def test_what_is_flush_beside_the_way_is_not_met() -> None:
    assert math.isinf(gap(SHAPES[0], Footprint(SQUARE + np.array([1.0, 0.4])), 0.0))
    wall = Footprint(SQUARE + np.array([0.1, 0.35]))
    assert math.isinf(gap(SHAPES[2], wall, 0.0))


def test_discs_meet_at_the_sum_of_the_radii() -> None:
    other = SHAPES[2].shifted(np.array([1.0, 0.18]))
    expected = 1.0 - math.sqrt(0.3**2 - 0.18**2)
    assert gap(SHAPES[2], other, 0.0) == pytest.approx(expected, abs=1e-12)


def test_a_small_overlap_is_a_gap_below_zero_and_only_further_in() -> None:
    other = Footprint(SQUARE + np.array([0.399, 0.0]))
    assert gap(SHAPES[0], other, 0.0) == pytest.approx(-0.001, abs=1e-12)
    assert math.isinf(gap(SHAPES[0], other, math.pi))


@given(st.floats(0.0, 6.28))
def test_gaps_are_the_same_seen_from_the_other(heading: float) -> None:
    far = SHAPES[1].moved(0.9 * math.cos(heading), 0.9 * math.sin(heading), 0.3)
    there = gap(SHAPES[0], far, heading)
    assume(math.isfinite(there))
    assert gap(far, SHAPES[0], heading + math.pi) == pytest.approx(there, abs=1e-9)
