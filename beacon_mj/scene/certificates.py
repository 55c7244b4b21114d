"""Certificates: what is proved about a scene before it may be used.

Free space is the workspace eroded by the robot's radius minus the footprints dilated
by it. "There is no path" is proved on a superset of the free space (inscribed
buffers) by connected components; "there is a path" by a path whose clearance was
checked exactly. Lengths are at most 0.6 % above the true ones.
"""

from collections.abc import Collection

import numpy as np
import shapely

from beacon_mj.geometry import Array, Footprints, polyline_length
from beacon_mj.motion.visibility_graph import VisibilityGraph
from beacon_mj.numerics import norm
from beacon_mj.scene import Certificate, Obstacle, Scene

#: Share of the drive's limit that an obstacle must stay under to be called a door.
DOOR_FORCE_SHARE = 0.85
#: What is closer than this is looked at exactly [m].
_NEAR_M = 1e-3


class _Outer:
    """The parts of a superset of the disc's free space in which start and goal lie.

    Attributes:
        connected: Whether it is one part. If not, there is no collision-free path.
    """

    def __init__(self, scene: Scene, obstacles: list[Obstacle]) -> None:
        radius = self._radius_m = scene.robot.radius_m
        west, south, east, north = scene.workspace_m
        room = shapely.box(west + radius, south + radius, east - radius, north - radius)
        blocked = shapely.union_all([self._blocked(o) for o in obstacles])
        parts = shapely.get_parts(room.difference(blocked))
        points = shapely.points([scene.start_m, scene.goal_m])
        within = [parts[shapely.covers(parts, point)] for point in points]
        self.connected = bool(len(within[0]) and within[0][0].covers(points[1]))
        self._ends = [  # A point that lies in none stands for itself.
            part[0] if len(part) else point
            for part, point in zip(within, points, strict=True)
        ]
        shapely.prepare(self._ends)

    def _blocked(self, obstacle: Obstacle, more_m: float = 0.0) -> shapely.Geometry:
        return obstacle.footprint.polygon(self._radius_m + more_m)

    def parted_by(self, obstacle: Obstacle) -> bool:
        """Whether an obstacle stands where the parts of start and goal both end.

        No other one can open a way, removed alone.
        """
        area = self._blocked(obstacle, _NEAR_M)
        return all(end.intersects(area) for end in self._ends)


def free_path(
    scene: Scene, obstacles: list[Obstacle], margin_m: float = 0.0
) -> Array | None:
    """Return the shortest path of the disc among `obstacles`, (m, 2) [m], or None.

    Args:
        scene: Workspace, start, goal and robot.
        obstacles: Those that stand in the way; the scene's others are ignored.
        margin_m: Clearance kept beyond the disc's radius.
    """
    return _graph(scene, obstacles, margin_m).shortest_path()


def _graph(
    scene: Scene,
    obstacles: list[Obstacle],
    margin_m: float,
    removable: Collection[Obstacle] = (),
) -> VisibilityGraph:
    """Return the visibility graph of start and goal among obstacles."""
    names = {o.id for o in removable}
    return VisibilityGraph(
        np.array(scene.start_m),
        np.array(scene.goal_m),
        Footprints.stack([o.footprint for o in obstacles]),
        scene.robot.radius_m + margin_m,
        scene.workspace_m,
        np.array([o.id in names for o in obstacles], dtype=np.bool_),
    )


def certify(scene: Scene, margin_m: float) -> Certificate | None:
    """Prove what holds for the scene's geometry.

    Args:
        scene: The scene; its own certificate is ignored.
        margin_m: Extra clearance that a way must have to be called practical.

    Returns:
        The certificate, or None where the proofs are inconclusive: a path that exists
        only within the margin, or none even with all pushable obstacles removed.
    """
    everything = list(scene.obstacles)
    outer = _Outer(scene, everything)
    free: Array | None = None
    if outer.connected:
        free = free_path(scene, everything)
        if free is None:
            return None
    limit = scene.robot.force_max_n
    reference = free_path(scene, [o for o in everything if not o.pushable(limit)])
    if reference is None:
        return None
    doors = _on_the_way(scene, outer, free, reference)
    graph = _graph(scene, everything, margin_m, doors)
    if free is not None and graph.shortest_path() is None:
        return None
    return Certificate(
        collision_free_length_m=None
        if free is None
        else round(polyline_length(free), 6),
        reference_length_m=round(polyline_length(reference), 6),
        straight_line_m=round(norm(np.subtract(scene.goal_m, scene.start_m)), 6),
        door_ids=_door_ids(scene, doors, graph, free),
        margin_m=margin_m,
    )


def door_candidates(scene: Scene) -> list[Obstacle]:
    """Return the movable obstacles that the robot can push with force to spare."""
    limit = DOOR_FORCE_SHARE * scene.robot.force_max_n
    return [
        o
        for o in scene.obstacles
        if o.interaction == "movable" and o.breakaway_force_n <= limit
    ]


def _on_the_way(
    scene: Scene, outer: _Outer, free: Array | None, reference: Array
) -> list[Obstacle]:
    """Return the candidates that stand where a door would have to."""
    doors = door_candidates(scene)
    if free is None:
        return [o for o in doors if outer.parted_by(o)]
    swept = shapely.LineString(reference).buffer(scene.robot.radius_m)
    return [o for o in doors if swept.intersects(o.outline)]


def _door_ids(
    scene: Scene, doors: list[Obstacle], graph: VisibilityGraph, free: Array | None
) -> tuple[str, ...]:
    """Return the doors whose removal alone opens a way, or shortens it by 10 %."""
    longest = np.inf if free is None else 0.9 * polyline_length(free)
    number = {o.id: i for i, o in enumerate(scene.obstacles)}
    found = []
    for door in doors:
        way = graph.shortest_path(number[door.id], longest + _NEAR_M)
        if way is not None and polyline_length(way) < longest:
            found.append(door.id)
    return tuple(found)
