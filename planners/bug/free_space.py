"""The boundary of free space, as Bug algorithms feel it with their hands.

The robot's centre may be anywhere in the workspace eroded by a clearance, less the
footprints dilated by it. The boundary of that set falls into closed contours: one
around each clump of obstacles, and one along the outer wall and what leans on it.

Shapes: m contour points (the last repeats the first), n footprints, q query points.
"""

import math

import numpy as np
import shapely

from beacon_mj.geometry import Array, Footprints, segment_lengths, signed_distance
from beacon_mj.jit import kernel

#: Facets per quarter circle of the dilated footprints: 0.2 mm off at 0.14 m.
_QUAD_SEGMENTS = 16


class Contour:
    """One closed contour, directed so that free space lies on its left.

    Attributes:
        points: Vertices, shape (m, 2) [m].
        length_m: Its perimeter [m].
    """

    def __init__(self, points: Array) -> None:
        """Take over a closed ring of points."""
        self.points = points
        self._arc = np.concatenate([[0.0], np.cumsum(segment_lengths(points))])
        self.length_m = float(self._arc[-1])

    def project(self, point: Array) -> float:
        """Arc length of the contour's point nearest to `point` [m]."""
        ring = shapely.linestrings(self.points)
        return float(shapely.line_locate_point(ring, shapely.points(point)))

    def between(self, start_m: float, end_m: float) -> float:
        """Distance along the contour from one arc length forward to another [m]."""
        return (end_m - start_m) % self.length_m

    def stretch(self, start_m: float, distance_m: float) -> Array:
        """Polyline from arc length `start_m`, `distance_m` (at most a lap) forward."""
        arc = np.concatenate([self._arc[:-1], self._arc + self.length_m])
        points = np.concatenate([self.points[:-1], self.points])
        ends = np.array([start_m, start_m + distance_m])
        inner = points[(arc > ends[0] + 1e-9) & (arc < ends[1] - 1e-9)]
        first, last = (
            np.array([np.interp(s, arc, points[:, i]) for i in (0, 1)]) for s in ends
        )
        return np.concatenate([first[None], inner, last[None]])


class FreeSpace:
    """Where the robot's centre may be on the known map, and its contours.

    Attributes:
        clearance_m: Distance that the centre keeps from footprints and walls [m].
        region: Free space; arcs of dilated footprints are inscribed polygons.
        contours: All contours, of every part of free space.
    """

    def __init__(
        self,
        footprints: Footprints,
        workspace_m: tuple[float, float, float, float],
        clearance_m: float,
        reverse: bool = False,
    ) -> None:
        """Build the contours; `reverse` directs them with free space on the right."""
        self._footprints = footprints
        self._workspace = np.array(workspace_m)
        self.clearance_m = clearance_m
        west, south, east, north = workspace_m
        room = shapely.box(
            west + clearance_m,
            south + clearance_m,
            east - clearance_m,
            north - clearance_m,
        )
        cores = shapely.convex_hull(shapely.multipoints(footprints.vertices))
        grown = shapely.buffer(
            cores, footprints.radius + clearance_m, quad_segs=_QUAD_SEGMENTS
        )
        self.region = shapely.difference(room, shapely.union_all(grown))
        parts = shapely.orient_polygons(shapely.get_parts(self.region))
        self._rings = shapely.get_rings(parts)
        step = -1 if reverse else 1
        self.contours = [
            Contour(np.ascontiguousarray(shapely.get_coordinates(ring)[::step]))
            for ring in self._rings
        ]

    def nearest(self, point: Array) -> Contour | None:
        """Contour that is nearest to `point`, or None if there is no free space."""
        if not self.contours:
            return None
        distances = shapely.distance(self._rings, shapely.points(point))
        return self.contours[int(np.argmin(distances))]

    def is_open(self, points: Array, goal: Array) -> Array:
        """Whether contour points face free space in the goal's direction.

        Args:
            points: Points on a contour, shape (q, 2) [m].
            goal: Where the robot would head from each, shape (2,) [m].

        Returns:
            Truth values, shape (q,).
        """
        away = goal - points
        ahead = away / np.maximum(np.hypot(*away.T), 1e-9)[:, None]
        # So near that another contour across a narrow gap is not reached.
        just_ahead = points + 1e-5 * ahead
        return np.asarray(shapely.contains_xy(self.region, just_ahead))

    def ray(self, start: Array, end: Array, slack_m: float) -> float:
        """Distance from `start` towards `end` until something is hit [m].

        A hit is where the clearance falls below `clearance_m` less `slack_m`. The
        length of the segment is returned if nothing is.
        """
        return _ray(
            np.asarray(start, dtype=np.float64),
            np.asarray(end, dtype=np.float64),
            self._footprints.vertices,
            self._footprints.radius,
            self._workspace,
            self.clearance_m - slack_m,
        )


@kernel
def _ray(
    start: Array,
    end: Array,
    vertices: Array,
    radius: Array,
    workspace: Array,
    need: float,
) -> float:
    """Sphere tracing: a step as long as the clearance can never pass a hit."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    length = math.sqrt(dx * dx + dy * dy)
    s = 0.0
    while s < length:
        x, y = start[0] + dx * s / length, start[1] + dy * s / length
        gap = min(
            x - workspace[0], y - workspace[1], workspace[2] - x, workspace[3] - y
        )
        for i in range(radius.shape[0]):
            gap = min(gap, signed_distance(x, y, vertices[i], radius[i]))
        if gap - need <= 0.0:
            return s
        s += max(gap - need, 2e-4)
    return length
