import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from beacon_mj.geometry import Footprint, Footprints
from beacon_mj.motion.grid import ClearanceField, Grid
from tests.kinematics import box, disc

ROOM = (-1.0, 0.0, 1.0, 1.5)


def obstacles() -> st.SearchStrategy[list[Footprint]]:
    """Discs and boxes in the room."""
    x, y = st.floats(-1.0, 1.0), st.floats(0.0, 1.5)
    size = st.floats(0.02, 0.3)
    discs = st.builds(disc, x, y, size)
    boxes = st.builds(lambda x, y, w, h: box(x, y, x + w, y + h), x, y, size, size)
    return st.lists(discs | boxes, min_size=1, max_size=4)


def brute_force(field: ClearanceField, footprints: Footprints) -> np.ndarray:
    grid = field.grid
    points = grid.centres(np.arange(grid.size))
    walls = np.minimum(points - ROOM[:2], np.array(ROOM[2:]) - points).min(axis=1)
    near = footprints.distances(points).min(axis=1, initial=np.inf)
    return np.asarray(np.minimum(np.minimum(walls, near), field.reach_m))


def test_cells_and_metres_are_inverse() -> None:
    grid = Grid.cover(ROOM, 0.05)
    assert (grid.rows, grid.cols) == (30, 40)
    centres = grid.centres(np.arange(grid.size))
    assert [grid.cell(c) for c in centres] == list(range(grid.size))
    assert np.allclose(centres[0], (-0.975, 0.025))


def test_a_point_outside_belongs_to_the_nearest_cell() -> None:
    grid = Grid.cover(ROOM, 0.05)
    assert grid.cell(np.array([5.0, 9.0])) == grid.size - 1
    assert grid.cell(np.array([-5.0, -9.0])) == 0


def test_disc_lists_the_cells_within_reach_nearest_first() -> None:
    grid = Grid.cover(ROOM, 0.05)
    point = np.array([0.11, 0.72])
    distance = np.linalg.norm(grid.centres(np.arange(grid.size)) - point, axis=1)
    cells = grid.disc(point, 0.2)
    assert set(cells) == set(np.flatnonzero(distance <= 0.2))
    assert np.all(np.diff(distance[cells]) >= 0.0)
    assert np.array_equal(grid.within(point, 0.2), np.sort(cells))


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(0.0, 1.0))
def test_a_disc_may_lie_outside_of_the_grid(x: float, y: float, radius: float) -> None:
    grid = Grid.cover(ROOM, 0.1)
    point = np.array([x, y])
    distance = np.linalg.norm(grid.centres(np.arange(grid.size)) - point, axis=1)
    wrong = set(grid.disc(point, radius)) ^ set(np.flatnonzero(distance <= radius))
    assert all(abs(distance[i] - radius) < 1e-9 for i in wrong)


@settings(max_examples=30, deadline=None)
@given(first=obstacles(), second=obstacles(), shift=st.floats(-0.3, 0.3))
def test_field_is_exact_after_additions_and_moves(
    first: list[Footprint], second: list[Footprint], shift: float
) -> None:
    field = ClearanceField(Grid.cover(ROOM, 0.1), 0.25)
    moved = [first[0].shifted(np.array([shift, 0.1])), *first[1:], *second]
    far = [first[0].shifted(np.array([-1000.0, -1000.0])), *first[1:], *second]
    for known in (first, first + second, moved, far, moved, second):
        footprints = Footprints.stack(known)
        before = field.values.copy()
        changed = field.update(footprints)
        assert set(changed) == set(np.flatnonzero(field.values != before))
        assert field.values == pytest.approx(brute_force(field, footprints))


def test_a_distant_footprint_changes_nothing_near_the_others() -> None:
    field = ClearanceField(Grid.cover(ROOM, 0.05), 0.14)
    one = disc(-0.5, 0.5, 0.1)
    field.update(Footprints.stack([one]))
    changed = field.update(Footprints.stack([one, disc(0.5, 0.7, 0.1)]))
    assert len(changed) > 0
    gaps = np.linalg.norm(field.grid.centres(changed) - (0.5, 0.7), axis=1)
    assert gaps.max() < 0.1 + 0.14
