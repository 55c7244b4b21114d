"""What the index finds is what a test of every segment against everything finds."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.motion.buckets import boxes, bucketed
from beacon_mj.motion.sight import (
    NOTHING,
    SOLID,
    TOUCH_M,
    covers,
    first_in_the_way,
    scratch_for,
    seen_from,
    solids,
)

SIZE_M = 8.0


@st.composite
def crowds(draw: st.DrawFn) -> tuple[Footprints, Array, np.ndarray, float]:
    """Footprints of all sorts, points among them, some removable, a clearance."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    footprints = [_footprint(rng) for _ in range(draw(st.integers(1, 40)))]
    points = rng.uniform(0.0, SIZE_M, (draw(st.integers(2, 12)), 2))
    removable = rng.random(len(footprints)) < draw(st.sampled_from([0.0, 0.2, 1.0]))
    clearance = draw(st.sampled_from([0.01, 0.12, 0.5]))
    return Footprints.stack(footprints), points, removable, clearance


def _footprint(rng: np.random.Generator) -> Footprint:
    x, y, yaw = *rng.uniform(0.0, SIZE_M, 2), rng.uniform(0.0, 6.0)
    a, b = rng.uniform(0.05, 1.5), rng.uniform(0.05, 0.4)
    match rng.integers(3):
        case 0:
            return Footprint(np.array([[x, y]]), b)
        case 1:
            return Footprint(np.array([[-a, 0.0], [a, 0.0]]), b).moved(x, y, yaw)
        case _:
            corners = np.array([[-a, -b], [a, -b], [a, b], [-a, b]])
            return Footprint(corners).moved(x, y, yaw)


def named(blocking: np.ndarray, removable: np.ndarray) -> int:
    """What stands in the way, of footprints that do (n,)."""
    found = np.flatnonzero(blocking)
    if len(found) == 0:
        return NOTHING
    return int(found[0]) if len(found) == 1 and removable[found[0]] else SOLID


@settings(max_examples=40, deadline=None)
@given(crowds(), st.sampled_from([0.1, 0.4, 1.0, 9.0]))
def test_sight_is_that_of_all_segments_against_all_footprints(
    crowd: tuple[Footprints, Array, np.ndarray, float], cell_m: float
) -> None:
    footprints, points, removable, clearance = crowd
    blocking = solids(footprints, clearance, removable=removable)
    frame = points.min(axis=0) - 1e-6, points.max(axis=0) + 1e-6, cell_m
    near = bucketed(*boxes(footprints, clearance), frame)
    of_points = bucketed(points, points, frame)
    scratch = scratch_for(points, near, blocking)
    limit = clearance - TOUCH_M
    too_near = footprints.distances(points) < limit
    expected = [named(row, removable) for row in too_near]
    assert covers(points, near, blocking).tolist() == expected
    for u, here in enumerate(points):
        seen, by = seen_from(u, points, of_points, near, blocking, scratch)
        found = dict(zip(seen.tolist(), by.tolist(), strict=True))
        for v, there in enumerate(points):
            gaps = footprints.segment_distance(here, there)
            what = named(gaps < limit, removable)
            (ax, ay), (bx, by) = here.tolist(), there.tolist()
            assert first_in_the_way(ax, ay, bx, by, near, blocking) == what
            if u != v:
                assert found.get(v, SOLID) == what
