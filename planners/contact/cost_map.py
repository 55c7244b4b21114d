"""The way through: paths over a cost map on which some obstacles may be pushed.

Edge costs are c_geom + lambda_occ c_occ + lambda_sem c_sem (paper II.E, II.H). Both
costs count as far as an obstacle that may be pushed stands in the disc's way: by the
share of the disc's width that it would cover, so that clipping a corner is cheaper
than going through the middle. Obstacles that may not be pushed are impassable.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from beacon_mj.geometry import Array, Footprint, Footprints
from beacon_mj.interface import Observation, Task
from beacon_mj.motion.grid import Cells, Grid, Window
from beacon_mj.motion.grid_route import Extra, GridRoute

#: Where an obstacle is put that shall not block: far outside of every workspace [m].
_ELSEWHERE_M = -1000.0


@dataclass(frozen=True, slots=True)
class Crossing:
    """A path goes through an obstacle that must be pushed.

    Attributes:
        index: The obstacle, in the order of the observation.
        entry_m: Where the path first comes too close, shape (2,) [m].
        exit_m: Where it is clear of it again, shape (2,) [m].
    """

    index: int
    entry_m: Array
    exit_m: Array


class _Spot(NamedTuple):
    """Where an obstacle would be in the disc's way, and how much.

    Attributes:
        outline: The footprint that this is of.
        window: Rows [r0, r1) and columns [c0, c1) that hold the cells.
        cells: Cells in which the disc would overlap it, shape (c,).
        share: Share of the disc's width that it covers there, shape (c,).
    """

    outline: Footprint
    window: Window
    cells: Cells
    share: Array


class CrossingCosts:
    """What going through obstacles costs in each cell of a grid.

    Attributes:
        extra: Extra cost of each cell, shape (n,) [m/m].
    """

    def __init__(self, grid: Grid, radius_m: float) -> None:
        """Count for a disc of `radius_m` [m] on the cells of `grid`."""
        self._grid = grid
        self._radius_m = radius_m
        self._charged: dict[int, tuple[_Spot, float]] = {}
        self._spots: dict[int, _Spot] = {}
        self.extra = np.zeros(grid.size)

    def update(self, observation: Observation, costs: Mapping[int, float]) -> Cells:
        """Bring `extra` up to date around the obstacles that cost something else now.

        Args:
            observation: The map.
            costs: Cost per metre of going right through each obstacle that may be
                pushed, by its index.

        Returns:
            Cells whose cost may have changed, in no particular order.
        """
        before = self._charged
        now = {i: (self._spot(i, observation), cost) for i, cost in costs.items()}
        self._charged = now
        changed = [
            spot
            for i in before.keys() | now.keys()
            if not _same(before.get(i), now.get(i))
            for spot, _ in filter(None, (before.get(i), now.get(i)))
        ]
        if not changed:
            return np.zeros(0, dtype=np.int64)
        for spot in changed:
            self.extra[spot.cells] = 0.0
        for i in _overlapping([*now], now, changed):
            (_, _, cells, share), cost = now[i]
            self.extra[cells] = np.maximum(self.extra[cells], cost * share)
        return np.concatenate([spot.cells for spot in changed])

    def _spot(self, i: int, observation: Observation) -> _Spot:
        """Return where the disc would overlap obstacle i, and by how much of its width.

        The overlap in depth, radius less signed distance, over the disc's diameter,
        at most one.
        """
        outline = observation.obstacles[i].footprint
        known = self._spots.get(i)
        if known is not None and known.outline is outline:
            return known
        radius, grid = self._radius_m, self._grid
        reach = outline.radius + radius
        window = grid.window(
            outline.vertices.min(axis=0) - reach, outline.vertices.max(axis=0) + reach
        )
        r0, r1, c0, c1 = window
        rows, cols = np.mgrid[r0:r1, c0:c1]
        cells = (rows * grid.cols + cols).ravel()
        gaps = Footprints.stack([outline]).distances(grid.centres(cells))[:, 0]
        near = gaps < radius
        share = np.minimum((radius - gaps[near]) / (2.0 * radius), 1.0)
        spot = self._spots[i] = _Spot(outline, window, cells[near], share)
        return spot


def _same(a: tuple[_Spot, float] | None, b: tuple[_Spot, float] | None) -> bool:
    """Whether an obstacle costs the same, at the same place."""
    return a is not None and b is not None and a[0] is b[0] and a[1] == b[1]


def _overlapping(
    names: list[int],
    charged: Mapping[int, tuple[_Spot, float]],
    spots: list[_Spot],
) -> list[int]:
    """Return the obstacles whose cells may be among those of some spots."""
    if not names:
        return []
    own = np.array([charged[i][0].window for i in names])
    near = np.zeros(len(names), dtype=np.bool_)
    for r0, r1, c0, c1 in dict.fromkeys(spot.window for spot in spots):
        rows = (own[:, 0] < r1) & (own[:, 1] > r0)
        near |= rows & (own[:, 2] < c1) & (own[:, 3] > c0)
    return [names[k] for k in np.flatnonzero(near)]


class ContactMap:
    """D* Lite on the cost map; some obstacles cost, the others block.

    Attributes:
        path: The last path, shape (m, 2) [m], or None.
    """

    def __init__(self, task: Task, cell_m: float, radius_m: float) -> None:
        """Plan on cells of `cell_m` [m] for a disc of `radius_m` [m]."""
        self._route = GridRoute(task, cell_m, radius_m)
        self._radius_m = radius_m
        self._costs = CrossingCosts(self._route.field.grid, radius_m)
        self.path: Array | None = None

    @property
    def expansions(self) -> int:
        """Vertices expanded since it was built."""
        return self._route.expansions

    def plan(self, observation: Observation, costs: Mapping[int, float]) -> None:
        """Plan from where the robot is.

        Args:
            observation: The map.
            costs: Cost per metre of going right through each obstacle that may be
                pushed, by its index; the others block.
        """
        recosted = self._costs.update(observation, costs)
        blocking = without(observation.footprints, list(costs))
        extra = Extra(self._costs.extra, recosted)
        self.path = self._route.plan(observation.position_m, blocking, extra)

    def crossing(
        self, observation: Observation, costs: Mapping[int, float]
    ) -> Crossing | None:
        """Return the first obstacle to be pushed on the last path, or None."""
        if self.path is None or not costs:
            return None
        soft = sorted(costs)
        every = observation.footprints
        crossed = Footprints(every.vertices[soft], every.radius[soft])
        radius_m = self._radius_m
        gaps = crossed.distances_within(self.path, radius_m) - radius_m
        # A robot that touches something now has not yet decided to cross it.
        inside = gaps < -0.5 * self._route.field.grid.cell_m
        rows = np.flatnonzero(inside.any(axis=1))
        if len(rows) == 0:
            return None
        first = int(rows[0])
        column = int(np.argmin(gaps[first]))
        after = np.flatnonzero(~inside[first:, column])
        last = first + int(after[0]) if len(after) else len(self.path) - 1
        return Crossing(soft[column], self.path[max(first - 1, 0)], self.path[last])


def without(footprints: Footprints, soft: list[int]) -> Footprints:
    """Return the footprints with some of them moved out of the way, order kept."""
    vertices = footprints.vertices.copy()
    vertices[soft] = _ELSEWHERE_M
    return Footprints(vertices, footprints.radius)
