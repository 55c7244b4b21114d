"""The push model: cascades against geometry done by hand and by shapely."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from beacon_mj.planners.contact.push_model import (
    PushWorld,
    gentle_speed_mps,
    impact_force_n,
    outline,
)
from tests.sensed import sensed_box

EAST = np.array([1.0, 0.0])


def row(count: int, gap: float) -> PushWorld:
    """Boxes of 0.3 m in a row to the east, `gap` metres apart."""
    return PushWorld(
        [sensed_box(f"b{i}", 1.0 + i * (0.3 + gap), 3.0) for i in range(count)]
    )


def nothing_is_fixed(index: int) -> bool:
    return False


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_row_needs_the_sum_of_forces(count: int) -> None:
    """Design 2.4, measured: a row of n boxes needs n times the force of one."""
    cascade = row(4, gap=0.05).cascade(
        0, (0.03 + 0.05 * (count - 1)) * EAST, lambda i: 5.0, 60.0, nothing_is_fixed
    )
    assert [i for i, _ in cascade.moved] == list(range(count))
    assert cascade.force_n == pytest.approx(5.0 * count)
    assert cascade.feasible


def test_travel_shrinks_by_the_gaps() -> None:
    cascade = row(2, gap=0.1).cascade(
        0, 0.3 * EAST, lambda i: 1.0, 60.0, nothing_is_fixed
    )
    (first, along), (second, pushed) = cascade.moved
    assert (first, second) == (0, 1)
    assert along == pytest.approx(0.3)
    assert pushed == pytest.approx(0.2, abs=0.012)


def test_cascade_stops_at_what_is_fixed() -> None:
    cascade = row(3, gap=0.05).cascade(
        0, 0.5 * EAST, lambda i: 5.0, 60.0, lambda i: i == 2
    )
    assert not cascade.feasible
    assert cascade.blocked_by == 2


def test_sum_of_forces_counts_not_each_link() -> None:
    cascade = row(3, gap=0.01).cascade(
        0, 0.5 * EAST, lambda i: 25.0, 60.0, nothing_is_fixed
    )
    assert not cascade.feasible
    assert cascade.force_n == pytest.approx(75.0)


def test_touching_neighbours_beside_the_way_are_not_hit() -> None:
    world = PushWorld([sensed_box("door", 2.0, 3.0), sensed_box("jamb", 2.0, 3.401)])
    cascade = world.cascade(0, 0.6 * EAST, lambda i: 5.0, 60.0, nothing_is_fixed)
    assert [i for i, _ in cascade.moved] == [0]


@settings(max_examples=60, deadline=None)
@given(
    st.floats(0.0, 2 * np.pi),
    st.lists(
        st.tuples(st.floats(0.4, 1.6), st.floats(0, 6.28)), min_size=1, max_size=6
    ),
)
def test_hits_agree_with_the_swept_polygon(
    heading: float, places: list[tuple[float, float]]
) -> None:
    """Who is hit first-hand, against shapely's convex hull of the sweep."""
    others = [
        sensed_box(f"o{k}", 3 + r * np.cos(a), 3 + r * np.sin(a))
        for k, (r, a) in enumerate(places)
    ]
    mover = sensed_box("m", 3.0, 3.0)
    travel = 0.8 * np.array([np.cos(heading), np.sin(heading)])
    world = PushWorld([mover, *others])
    hit = {i for i, _ in world._hits(0, travel)}
    corners = mover.footprint.vertices
    sweep = shapely.MultiPoint(np.vstack([corners, corners + travel])).convex_hull
    for i, other in enumerate(others, start=1):
        depth = sweep.intersection(other.footprint.polygon()).area
        away = sweep.distance(other.footprint.polygon())
        if depth > 0.01:
            assert i in hit
        elif away > 1e-6:
            assert i not in hit


def test_round_outline_holds_the_disc_to_a_facet() -> None:
    ball = sensed_box("a").footprint
    polygon = shapely.Polygon(outline(ball))
    assert polygon.equals(ball.polygon())


def test_impact_force_of_the_design() -> None:
    """Design 2.4: 0.4 m/s against a 4.05 kg box on a 5 kN/m bumper, 48 N."""
    assert impact_force_n(0.4, 4.05, 10.0, 5000.0) == pytest.approx(48.0, abs=0.1)


@given(st.floats(1.0, 50.0), st.floats(0.5, 50.0))
def test_gentle_speed_inverts_the_impact(force: float, mass: float) -> None:
    speed = gentle_speed_mps(force, mass, 10.0, 5000.0)
    assert impact_force_n(speed, mass, 10.0, 5000.0) == pytest.approx(force)
