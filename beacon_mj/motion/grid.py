"""A uniform grid over the workspace, and how far each cell is from anything solid.

Cells are numbered row by row from the south-west corner: `cell = row * cols + col`,
x grows with the column and y with the row. The outermost cells touch the walls, and
every search on the grid treats them as blocked.

Shapes: n cells (rows * cols), m points, f footprints, k core vertices.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from beacon_mj.geometry import Array, Footprints, signed_distance
from beacon_mj.jit import kernel

Cells = NDArray[np.int64]
Window = tuple[int, int, int, int]  #: Rows [r0, r1) and columns [c0, c1).


@dataclass(frozen=True, kw_only=True, slots=True)
class Grid:
    """Where the cells of a uniform grid lie.

    Attributes:
        west_m: West edge of the first column [m].
        south_m: South edge of the first row [m].
        cell_m: Edge length of a cell [m].
        rows: Number of rows.
        cols: Number of columns.
    """

    west_m: float
    south_m: float
    cell_m: float
    rows: int
    cols: int

    @classmethod
    def cover(
        cls, workspace_m: tuple[float, float, float, float], cell_m: float = 0.05
    ) -> "Grid":
        """Return the smallest grid over a workspace (west, south, east, north) [m]."""
        west, south, east, north = workspace_m
        cols = math.ceil((east - west) / cell_m - 1e-9)
        rows = math.ceil((north - south) / cell_m - 1e-9)
        return cls(west_m=west, south_m=south, cell_m=cell_m, rows=rows, cols=cols)

    @property
    def size(self) -> int:
        """Number of cells."""
        return self.rows * self.cols

    def cell(self, point: Array) -> int:
        """Cell that holds `point` (2,) [m]; the nearest one for a point outside."""
        col = int((point[0] - self.west_m) / self.cell_m)
        row = int((point[1] - self.south_m) / self.cell_m)
        row = min(max(row, 0), self.rows - 1)
        return row * self.cols + min(max(col, 0), self.cols - 1)

    def centres(self, cells: Cells) -> Array:
        """Centres of `cells` (m,), shape (m, 2) [m]."""
        row, col = np.divmod(cells, self.cols)
        x = self.west_m + (col + 0.5) * self.cell_m
        return np.stack([x, self.south_m + (row + 0.5) * self.cell_m], axis=-1)

    def disc(self, point: Array, radius_m: float) -> Cells:
        """Cells whose centres lie within `radius_m` of `point`, nearest first."""
        cells, distance = self._around(point, radius_m)
        order = np.argsort(distance, kind="stable")
        return np.asarray(cells[order[: np.count_nonzero(distance <= radius_m)]])

    def within(self, point: Array, radius_m: float) -> Cells:
        """The same cells as `disc`, in the order of the grid: sorting takes time."""
        cells, distance = self._around(point, radius_m)
        return np.asarray(cells[distance <= radius_m])

    def _around(self, point: Array, radius_m: float) -> tuple[Cells, Array]:
        """Cells of the square about a disc, and how far their centres are (m,) [m]."""
        window = self.window(point - radius_m, point + radius_m)
        x, y = point.tolist()
        return _distances_in(
            *window,
            self.cols,
            float(self.west_m),
            float(self.south_m),
            self.cell_m,
            x,
            y,
        )

    def window(self, low: Array, high: Array) -> Window:
        """Rows [r0, r1) and columns [c0, c1) that cover a box between two corners.

        A box outside of the grid has none: r0 = r1 or c0 = c1.
        """
        (west, south), (east, north) = low.tolist(), high.tolist()
        c0 = math.floor((west - self.west_m) / self.cell_m)
        r0 = math.floor((south - self.south_m) / self.cell_m)
        c1 = math.ceil((east - self.west_m) / self.cell_m)
        r1 = math.ceil((north - self.south_m) / self.cell_m)
        r0, c0 = min(max(r0, 0), self.rows), min(max(c0, 0), self.cols)
        r1, c1 = min(r1, self.rows), min(c1, self.cols)
        return r0, max(r0, r1), c0, max(c0, c1)


class ClearanceField:
    """Signed distance from every cell's centre to the nearest footprint or wall.

    The field is exact up to `reach_m` and capped there, so that a new or moved
    footprint touches only the cells around it. A cell is blocked for a disc of
    radius r exactly where the field is below r.

    Attributes:
        grid: Where the cells lie.
        reach_m: Largest distance that is told apart [m].
        values: The field, negative inside a footprint, shape (n,) [m].
    """

    def __init__(self, grid: Grid, reach_m: float) -> None:
        """Build the field of an empty workspace, where only walls are near."""
        self.grid = grid
        self.reach_m = reach_m
        self.values = np.full(grid.size, reach_m)
        self._known = Footprints()
        self._refresh((0, grid.rows, 0, grid.cols), self._known, rebuild=True)

    def update(self, footprints: Footprints) -> Cells:
        """Take over a new list of footprints.

        Args:
            footprints: All known footprints. Old ones keep their places in the list.

        Returns:
            Cells whose value changed, in no particular order.
        """
        known, self._known = self._known, footprints
        if len(footprints) < len(known):
            whole = (0, self.grid.rows, 0, self.grid.cols)
            return self._refresh(whole, footprints, rebuild=True)
        changed = [
            self._refresh(window, footprints, rebuild=True)
            for i in _moved(known, footprints)
            for window in self._left_and_entered(known, footprints, i)
        ]
        for i in range(len(known), len(footprints)):
            new = Footprints(footprints.vertices[i : i + 1], footprints.radius[i:][:1])
            window = self._around(footprints, i)
            changed.append(self._refresh(window, new, rebuild=False))
        if not changed:
            return np.zeros(0, dtype=np.int64)
        return changed[0] if len(changed) == 1 else np.unique(np.concatenate(changed))

    def _left_and_entered(
        self, before: Footprints, after: Footprints, index: int
    ) -> list[Window]:
        """Windows of cells that a footprint may have reached, and may reach now.

        They are one where they overlap: a footprint that moved a little.
        """
        old, new = self._around(before, index), self._around(after, index)
        r0, r1 = max(old[0], new[0]), min(old[1], new[1])
        c0, c1 = max(old[2], new[2]), min(old[3], new[3])
        if r0 >= r1 or c0 >= c1:
            return [old, new]
        return [
            (min(old[0], new[0]), max(old[1], new[1]),
             min(old[2], new[2]), max(old[3], new[3]))
        ]  # fmt: skip

    def _around(self, footprints: Footprints, index: int) -> Window:
        """Window of cells that footprint `index` may reach."""
        core = footprints.vertices[index]
        grown = self.reach_m + footprints.radius[index]
        return self.grid.window(core.min(axis=0) - grown, core.max(axis=0) + grown)

    def _refresh(
        self,
        window: Window,
        footprints: Footprints,
        *,
        rebuild: bool,
    ) -> Cells:
        """Recompute a window, from the walls up or on top of what is there."""
        grid = self.grid
        frame = np.array([grid.west_m, grid.south_m, grid.cell_m, self.reach_m])
        first = footprints.vertices[:, :1]
        offset = footprints.vertices - first
        span = np.sqrt((offset * offset).sum(axis=2)).max(axis=1, initial=0.0)
        return _refresh(
            self.values.reshape(grid.rows, grid.cols),
            frame,
            np.array(window, dtype=np.int64),
            np.ascontiguousarray(footprints.vertices),
            np.ascontiguousarray(footprints.radius),
            span + footprints.radius,
            rebuild,
        )


@kernel
def _distances_in(
    r0: int,
    r1: int,
    c0: int,
    c1: int,
    cols: int,
    west: float,
    south: float,
    edge: float,
    px: float,
    py: float,
) -> tuple[Cells, Array]:
    """Return the cells of a window, and how far their centres are from a point [m]."""
    cells = np.empty((r1 - r0) * (c1 - c0), dtype=np.int64)
    distance = np.empty(len(cells))
    n = 0
    for row in range(r0, r1):
        y = south + (row + 0.5) * edge - py
        for col in range(c0, c1):
            x = west + (col + 0.5) * edge - px
            cells[n] = row * cols + col
            distance[n] = math.sqrt(x * x + y * y)
            n += 1
    return cells, distance


def _moved(before: Footprints, after: Footprints) -> Cells:
    """Indices of footprints of `before` that differ in `after`."""
    n, width = len(before), after.vertices.shape[1]
    old = before.vertices
    if n and old.shape[1] < width:
        old = np.concatenate([old, np.repeat(old[:, -1:], width, axis=1)], axis=1)
    same = (old[:, :width] == after.vertices[:n]).all(axis=(1, 2)) if n else True
    return np.flatnonzero(~(same & (before.radius == after.radius[:n])))


@kernel
def _refresh(
    values: Array,
    frame: Array,
    window: Cells,
    vertices: Array,
    radius: Array,
    extent: Array,
    rebuild: bool,
) -> Cells:
    """Fill a window of `values` (rows, cols) and return the cells that changed.

    `extent` (f,) bounds how far each footprint reaches from its first vertex [m];
    `frame` is the west and south edge, the cell's size and the cap of the field.
    """
    r0, r1, c0, c1 = window[0], window[1], window[2], window[3]
    rows, cols = values.shape
    changed = np.empty(max(r1 - r0, 0) * max(c1 - c0, 0), dtype=np.int64)
    count = 0
    for row in range(r0, r1):
        y = frame[1] + (row + 0.5) * frame[2]
        to_wall_y = min(row + 0.5, rows - row - 0.5) * frame[2]
        for col in range(c0, c1):
            x = frame[0] + (col + 0.5) * frame[2]
            best = values[row, col]
            if rebuild:
                to_wall_x = min(col + 0.5, cols - col - 0.5) * frame[2]
                best = min(frame[3], to_wall_x, to_wall_y)
            for i in range(radius.shape[0]):
                dx, dy = x - vertices[i, 0, 0], y - vertices[i, 0, 1]
                near = best + extent[i]
                if near > 0.0 and dx * dx + dy * dy < near * near:
                    best = min(best, signed_distance(x, y, vertices[i], radius[i]))
            if best != values[row, col]:
                values[row, col] = best
                changed[count] = row * cols + col
                count += 1
    return changed[:count]
