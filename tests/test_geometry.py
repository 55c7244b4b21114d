"""Footprint geometry against shapely."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from beacon_mj.geometry import (
    Footprint,
    Footprints,
    convex_hull,
    core_centroid,
    polygon_area,
    polyline_length,
    segment_lengths,
)

numbers = st.floats(-3.0, 3.0, allow_nan=False, width=32).map(lambda v: round(v, 3))
points = st.tuples(numbers, numbers).map(np.array)
radii = st.one_of(st.just(0.0), st.floats(0.05, 1.0))


@st.composite
def cores(draw: st.DrawFn) -> np.ndarray:
    """A point, a segment, or a convex polygon that is no sliver."""
    count = draw(st.integers(1, 8))
    angles = sorted(draw(st.sets(st.integers(0, 35), min_size=count, max_size=count)))
    scale = draw(st.floats(0.2, 1.5))
    centre = draw(points)
    turn = draw(st.floats(0.0, 6.28))
    around = np.array(angles) * (math.pi / 18) + turn
    return centre + scale * np.column_stack([np.cos(around), np.sin(around)])


footprints = st.builds(Footprint, cores(), radii)


def core_of(footprint: Footprint) -> shapely.Geometry:
    v = footprint.vertices
    if len(v) == 1:
        return shapely.Point(v[0])
    return shapely.LineString(v) if len(v) == 2 else shapely.Polygon(v)


def oracle(footprint: Footprint, point: np.ndarray) -> float:
    """Signed distance by shapely."""
    core, p = core_of(footprint), shapely.Point(point)
    if core.geom_type == "Polygon" and core.contains(p):
        return float(-core.exterior.distance(p) - footprint.radius)
    return float(core.distance(p) - footprint.radius)


@given(st.lists(footprints, min_size=1, max_size=6), st.lists(points, min_size=1))
def test_signed_distances(shapes: list[Footprint], queries: list[np.ndarray]) -> None:
    got = Footprints.stack(shapes).distances(np.array(queries))
    expected = [[oracle(f, q) for f in shapes] for q in queries]
    np.testing.assert_allclose(got, expected, atol=1e-9)


@given(st.lists(footprints, min_size=1, max_size=6), points, points)
def test_segment_distances(
    shapes: list[Footprint], start: np.ndarray, end: np.ndarray
) -> None:
    got = Footprints.stack(shapes).segment_distance(start, end)
    segment = shapely.LineString([start, end])
    expected = [max(0.0, core_of(f).distance(segment) - f.radius) for f in shapes]
    np.testing.assert_allclose(got, expected, atol=1e-9)


@given(st.lists(footprints, min_size=1, max_size=6), points)
def test_nearest_points_lie_on_the_boundary_at_the_distance(
    shapes: list[Footprint], query: np.ndarray
) -> None:
    stacked = Footprints.stack(shapes)
    near = stacked.nearest_points(query)
    gaps = stacked.distance(query)
    for f, q, gap in zip(shapes, near, gaps, strict=True):
        depth = core_of(f).boundary.distance(shapely.Point(query))
        if f.radius > 0.0 and depth < 1e-9:
            continue  # Every direction is nearest from the core's own boundary.
        # From inside a rounded core the nearest boundary point of the core is
        # pushed outward, so that it is still on the outline.
        assert oracle(f, q) == pytest.approx(0.0, abs=1e-6)
        assert np.hypot(*(q - query)) == pytest.approx(abs(gap), abs=1e-6)


@given(footprints, st.just(0.0) | st.floats(1e-6, 0.5))
def test_polygon_is_inside_the_dilated_footprint(f: Footprint, grow: float) -> None:
    outline = f.polygon(grow)
    coordinates = shapely.get_coordinates(outline)
    gaps = Footprints.stack([f]).distances(coordinates)[:, 0]
    assert gaps.max() <= grow + 1e-9
    if f.radius + grow > 0.0:
        true = core_of(f).buffer(f.radius + grow, quad_segs=256)
        assert outline.area == pytest.approx(true.area, rel=2e-3)


@given(footprints, points, st.floats(-7.0, 7.0), points)
def test_moving_a_footprint_keeps_distances(
    f: Footprint, offset: np.ndarray, yaw: float, query: np.ndarray
) -> None:
    c, s = math.cos(yaw), math.sin(yaw)
    turned = np.array([c * query[0] - s * query[1], s * query[0] + c * query[1]])
    before = Footprints.stack([f]).distance(query)[0]
    after = Footprints.stack([f.moved(offset[0], offset[1], yaw)])
    assert after.distance(turned + offset)[0] == pytest.approx(before, abs=1e-9)


@given(st.lists(points, min_size=1, max_size=20))
def test_convex_hull_is_shapelys_and_counter_clockwise(cloud: list[np.ndarray]) -> None:
    hull = convex_hull(np.array(cloud))
    expected = shapely.convex_hull(shapely.multipoints(np.array(cloud)))
    assert {tuple(p) for p in hull} == {
        tuple(p) for p in shapely.get_coordinates(expected)
    }
    if len(hull) > 2:
        assert polygon_area(hull) == pytest.approx(expected.area)


@given(cores())
def test_centroid_and_area_are_shapelys(core: np.ndarray) -> None:
    shape = core_of(Footprint(core))
    np.testing.assert_allclose(
        core_centroid(core), shapely.get_coordinates(shape.centroid)[0], atol=1e-9
    )
    if len(core) > 2:
        assert polygon_area(core) == pytest.approx(shape.area)


@settings(max_examples=20)
@given(points)
def test_no_footprints_give_empty_answers(query: np.ndarray) -> None:
    empty = Footprints.stack([])
    assert len(empty) == 0
    assert empty.distance(query).shape == (0,)
    assert empty.nearest_points(query).shape == (0, 2)
    assert empty.segment_distance(query, query).shape == (0,)


def test_padding_changes_nothing() -> None:
    disc = Footprint(np.array([[1.0, 1.0]]), 0.3)
    square = Footprint(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]))
    rod = Footprint(np.array([[2.0, 0.0], [3.0, 0.0]]), 0.1)
    query = np.array([2.0, 2.0])
    together = Footprints.stack([disc, square, rod]).distance(query)
    alone = [Footprints.stack([f]).distance(query)[0] for f in (disc, square, rod)]
    np.testing.assert_array_equal(together, alone)


polylines = st.lists(points, min_size=1, max_size=12).map(np.array)


@given(polylines)
def test_the_length_of_a_polyline_is_shapelys(path: np.ndarray) -> None:
    pieces = segment_lengths(path)
    assert pieces.shape == (len(path) - 1,)
    expected = shapely.LineString(path).length if len(path) > 1 else 0.0
    assert polyline_length(path) == pytest.approx(expected, abs=1e-12)
    assert polyline_length(path[::-1]) == pytest.approx(expected, abs=1e-12)


@given(polylines, st.integers(0, 100), st.floats(0.0, 1.0))
def test_a_point_on_a_polyline_adds_nothing_and_leaving_one_out_no_more(
    path: np.ndarray, where: int, share: float
) -> None:
    length = polyline_length(path)
    k = where % len(path)
    between = path[k] + share * (path[(k + 1) % len(path)] - path[k])
    if k + 1 < len(path):
        longer = np.insert(path, k + 1, between, axis=0)
        assert polyline_length(longer) == pytest.approx(length, abs=1e-9)
    shorter = np.delete(path, k, axis=0)
    assert len(shorter) == 0 or polyline_length(shorter) <= length + 1e-9
