"""Shortest paths against closed forms and a brute-force visibility graph."""

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra

from beacon_mj.geometry import Array, Footprint, Footprints, polyline_length
from beacon_mj.motion.visibility_graph import (
    VisibilityGraph,
    free_at,
    shortest_path,
)

BOUNDS = (0.0, 0.0, 6.0, 6.0)
START, GOAL = np.array([0.5, 3.0]), np.array([5.5, 3.0])
RADIUS = 0.12
EXCESS = 1.007  #: Circumscribed arcs are at most this much longer.


def disc(x: float, y: float, radius: float) -> Footprint:
    return Footprint(np.array([[x, y]]), radius)


def box(x: float, y: float, a: float, b: float, yaw: float = 0.0) -> Footprint:
    corners = np.array([[-a, -b], [a, -b], [a, b], [-a, b]])
    return Footprint(corners).moved(x, y, yaw)


def solve(obstacles: list[Footprint], clearance: float = RADIUS) -> Array | None:
    return shortest_path(START, GOAL, Footprints.stack(obstacles), clearance, BOUNDS)


def brute_force(obstacles: list[Footprint], clearance: float) -> float:
    """Length by Dijkstra over all pairs of vertices of inscribed buffers [m]."""
    blocked = shapely.union_all(
        [shapely.buffer(f.polygon(), clearance, quad_segs=16) for f in obstacles]
    )
    west, south, east, north = BOUNDS
    room = shapely.box(
        west + clearance, south + clearance, east - clearance, north - clearance
    )
    corners = shapely.get_coordinates(blocked)
    corners = corners[shapely.covers(room, shapely.points(corners))]
    nodes = np.vstack([START, GOAL, corners])
    i, j = np.triu_indices(len(nodes), 1)
    segments = shapely.linestrings(np.stack([nodes[i], nodes[j]], axis=1))
    inner = blocked.buffer(-1e-7)
    shapely.prepare(inner)
    free = ~shapely.intersects(inner, segments)
    weights = np.full((len(nodes), len(nodes)), np.inf)
    weights[i[free], j[free]] = shapely.length(segments[free])
    weights[np.isinf(weights)] = 0.0
    return float(dijkstra(weights, directed=False, indices=0)[1])


def test_a_free_way_is_straight() -> None:
    path = solve([disc(3.0, 5.0, 0.5)])
    assert path is not None
    np.testing.assert_array_equal(path, [START, GOAL])


@pytest.mark.parametrize("radius", [0.2, 0.5, 1.2])
@pytest.mark.parametrize("clearance", [0.05, 0.12, 0.4])
def test_path_around_a_disc_is_two_tangents_and_an_arc(
    radius: float, clearance: float
) -> None:
    path = solve([disc(3.0, 3.0, radius)], clearance)
    grown, half = radius + clearance, 2.5
    tangent = math.sqrt(half**2 - grown**2)
    arc = grown * (math.pi - 2.0 * math.acos(grown / half))
    assert path is not None
    assert 2 * tangent + arc <= polyline_length(path) <= EXCESS * (2 * tangent + arc)


def test_path_around_a_wall_turns_at_its_two_corners() -> None:
    path = solve([box(3.0, 3.0, 0.1, 1.0)], 0.01)
    assert path is not None
    expected = 2.0 * math.hypot(2.4, 1.0) + 0.2
    assert polyline_length(path) == pytest.approx(expected, rel=5e-3)


def test_no_path_through_a_gap_narrower_than_the_disc() -> None:
    """Two slabs leave a gap of 0.24 m and less, or more, for a disc of 0.24 m."""
    for gap, passable in ((0.23, False), (0.25, True)):
        lower = box(3.0, 0.5 * (3.0 - 0.5 * gap), 0.2, 0.5 * (3.0 - 0.5 * gap))
        upper = box(3.0, 6.0 - 0.5 * (3.0 - 0.5 * gap), 0.2, 0.5 * (3.0 - 0.5 * gap))
        assert (solve([lower, upper]) is not None) is passable


def test_no_path_between_an_obstacle_and_a_wall_that_is_too_near() -> None:
    slab = box(3.0, 3.1, 0.2, 2.9)
    assert solve([slab]) is None
    assert solve([box(3.0, 3.3, 0.2, 2.7)]) is not None


@st.composite
def rooms(draw: st.DrawFn) -> list[Footprint]:
    obstacles = []
    for _ in range(draw(st.integers(1, 4))):
        x, y = draw(st.floats(1.5, 4.5)), draw(st.floats(1.0, 5.0))
        size = draw(st.floats(0.1, 0.7))
        if draw(st.booleans()):
            obstacles.append(disc(x, y, size))
        else:
            yaw = draw(st.floats(0.0, 3.2))
            obstacles.append(box(x, y, size, draw(st.floats(0.1, 0.7)), yaw))
    return obstacles


@settings(max_examples=25)
@given(rooms(), st.sampled_from([0.05, 0.12, 0.3]))
def test_length_is_brute_forces(obstacles: list[Footprint], clearance: float) -> None:
    stacked = Footprints.stack(obstacles)
    assume(free_at(START, stacked, clearance, BOUNDS))
    assume(free_at(GOAL, stacked, clearance, BOUNDS))
    shortest = brute_force(obstacles, clearance)
    path = solve(obstacles, clearance)
    if path is None:
        # The circumscribed corners may stick out of a gap that is barely open.
        wider = brute_force(obstacles, 1.03 * clearance + 0.01)
        assert math.isinf(wider) or wider > EXCESS * shortest
        return
    assert shortest * (1.0 - 1e-6) <= polyline_length(path)
    tighter = brute_force(obstacles, 1.01 * clearance + 0.002)
    assert polyline_length(path) <= 1.01 * EXCESS * max(shortest, tighter)
    clear = [stacked.segment_distance(a, b).min() for a, b in itertools.pairwise(path)]
    assert min(clear) >= clearance - 1e-8


@settings(max_examples=25)
@given(rooms(), st.sampled_from([0.05, 0.12, 0.3]))
def test_a_graph_without_one_footprint_is_that_of_the_others(
    obstacles: list[Footprint], clearance: float
) -> None:
    stacked, some = Footprints.stack(obstacles), np.arange(len(obstacles)) % 2 == 0
    graph = VisibilityGraph(START, GOAL, stacked, clearance, BOUNDS, some)
    expected = solve(obstacles, clearance)
    np.testing.assert_array_equal(graph.shortest_path(), expected)
    for k in np.flatnonzero(some).tolist():
        others = [o for i, o in enumerate(obstacles) if i != k]
        found = graph.shortest_path(without=k)
        np.testing.assert_array_equal(found, solve(others, clearance))


@given(st.tuples(st.floats(0.0, 6.0), st.floats(0.0, 6.0)), rooms())
def test_free_at_is_shapelys(
    point: tuple[float, float], obstacles: list[Footprint]
) -> None:
    distances = [Footprints.stack([f]).distance(np.array(point))[0] for f in obstacles]
    x, y = point
    margin = min(*distances, x, y, 6.0 - x, 6.0 - y) - RADIUS
    assume(abs(margin) > 1e-6)
    stacked = Footprints.stack(obstacles)
    assert free_at(np.array(point), stacked, RADIUS, BOUNDS) is bool(margin > 0.0)
