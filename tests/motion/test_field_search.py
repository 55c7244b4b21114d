"""A repaired search gives the numbers of a search from scratch, to the bit."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from beacon_mj.geometry import Array
from beacon_mj.motion.field_search import RepairedSearch, WholeSearch
from beacon_mj.motion.grid import Cells, Grid

GRID = Grid(west_m=0.0, south_m=0.0, cell_m=0.05, rows=24, cols=30)


class Room:
    """Costs of cells that change, and where the robot stands."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.cost = self.rng.uniform(0.0, 2.0, GRID.size)
        self.change(np.arange(GRID.size))

    def costs(self, cells: Cells) -> Array:
        return np.asarray(self.cost[cells])

    def change(self, cells: Cells) -> None:
        drawn = self.rng.uniform(0.0, 2.0, len(cells))
        self.cost[cells] = np.where(self.rng.random(len(cells)) < 0.35, np.inf, drawn)
        self.cost[self.rng.random(GRID.size) < 0.001] = 0.0
        rim = self.cost.reshape(GRID.rows, GRID.cols)
        rim[[0, -1], :] = rim[:, [0, -1]] = np.inf


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 12))
def test_least_times_are_those_of_a_search_from_scratch(seed: int, rounds: int) -> None:
    room = Room(seed)
    rng, whole, repaired = room.rng, WholeSearch(GRID), RepairedSearch(GRID)
    root = int(rng.integers(GRID.size))
    for _ in range(rounds):
        before = room.cost.copy()
        room.change(rng.integers(0, GRID.size, 20))
        changed = np.flatnonzero(before != room.cost)
        if rng.random() < 0.2:
            root = int(rng.integers(GRID.size))
        for search in (whole, repaired):
            search.note(changed)
            search.update(room.costs, root)
        for _ in range(3):
            point = rng.uniform((0.0, 0.0), (1.5, 1.2))
            cells = GRID.disc(point, 0.15)
            away = np.sqrt(((GRID.centres(cells) - point) ** 2).sum(axis=1))
            near = GRID.cell(point)
            expected = whole.metres(cells, away, near)
            found = repaired.metres(cells, away, near)
            known = np.isfinite(found)
            np.testing.assert_array_equal(found[known], expected[known])
            assert (found + away).min() == (expected + away).min()
