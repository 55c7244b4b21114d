"""The way through: paths over a cost map on which some obstacles may be pushed.

Edge costs are c_geom + lambda_occ c_occ + lambda_sem c_sem (paper II.E, II.H). Both
costs count as far as an obstacle that may be pushed stands in the disc's way: by the
share of the disc's width that it would cover, so that clipping a corner is cheaper
than going through the middle. Obstacles that may not be pushed are impassable.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from beacon_mj.geometry import Array, Footprints
from beacon_mj.interface import Observation, Task
from beacon_mj.motion.grid import Cells, Grid
from beacon_mj.motion.grid_route import GridRoute

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


class CrossingCosts:
    """What going through obstacles costs in each cell of a grid."""

    def __init__(self, grid: Grid, radius_m: float) -> None:
        """Count for a disc of `radius_m` [m] on the cells of `grid`."""
        self._grid = grid
        self._radius_m = radius_m
        self._covers: dict[int, tuple[object, Cells, Array]] = {}

    def over_grid(self, observation: Observation, costs: Mapping[int, float]) -> Array:
        """Return the extra cost of each cell, shape (n,) [m/m].

        Args:
            observation: The map.
            costs: Cost per metre of going right through each obstacle that may be
                pushed, by its index.
        """
        extra = np.zeros(self._grid.size)
        for i, cost in costs.items():
            cells, share = self._covered(i, observation)
            extra[cells] = np.maximum(extra[cells], cost * share)
        return extra

    def _covered(self, i: int, observation: Observation) -> tuple[Cells, Array]:
        """Return where the disc would overlap obstacle i, and by how much of its width.

        The overlap in depth, radius less signed distance, over the disc's diameter,
        at most one.
        """
        outline = observation.obstacles[i].footprint
        cached = self._covers.get(i)
        if cached is None or cached[0] is not outline:
            radius, grid = self._radius_m, self._grid
            reach = outline.radius + radius
            r0, r1, c0, c1 = grid.window(
                outline.vertices.min(axis=0) - reach,
                outline.vertices.max(axis=0) + reach,
            )
            rows, cols = np.mgrid[r0:r1, c0:c1]
            cells = (rows * grid.cols + cols).ravel()
            gaps = Footprints.stack([outline]).distances(grid.centres(cells))[:, 0]
            near = gaps < radius
            share = np.minimum((radius - gaps[near]) / (2.0 * radius), 1.0)
            cached = self._covers[i] = (outline, cells[near], share)
        return cached[1], cached[2]


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
        extra = self._costs.over_grid(observation, costs)
        blocking = without(observation.footprints, list(costs))
        self.path = self._route.plan(observation.position_m, blocking, extra)

    def crossing(
        self, observation: Observation, costs: Mapping[int, float]
    ) -> Crossing | None:
        """Return the first obstacle to be pushed on the last path, or None."""
        if self.path is None or not costs:
            return None
        soft = sorted(costs)
        gaps = observation.footprints.distances(self.path)[:, soft] - self._radius_m
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
