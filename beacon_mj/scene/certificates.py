"""Certificates: what is proved about a scene before it may be used.

Free space is the workspace eroded by the robot's radius minus the footprints dilated
by it. "There is no path" is proved on a superset of the free space (inscribed
buffers) by connected components; "there is a path" by a path whose clearance was
checked exactly. Lengths are at most 0.6 % above the true ones.
"""

import numpy as np
import shapely

from beacon_mj.geometry import Array, Footprints, polyline_length
from beacon_mj.motion.visibility_graph import shortest_path
from beacon_mj.numerics import norm
from beacon_mj.scene import Certificate, Obstacle, Scene

#: Share of the drive's limit that an obstacle must stay under to be called a door.
DOOR_FORCE_SHARE = 0.85


def connected_outer(scene: Scene, obstacles: list[Obstacle]) -> bool:
    """Whether start and goal are connected in a superset of the disc's free space.

    False proves that no collision-free path exists among `obstacles`.
    """
    radius = scene.robot.radius_m
    west, south, east, north = scene.workspace_m
    room = shapely.box(west + radius, south + radius, east - radius, north - radius)
    blocked = shapely.union_all([o.footprint.polygon(radius) for o in obstacles])
    for part in shapely.get_parts(room.difference(blocked)):
        if part.covers(shapely.Point(scene.start_m)):
            return bool(part.covers(shapely.Point(scene.goal_m)))
    return False


def free_path(
    scene: Scene, obstacles: list[Obstacle], margin_m: float = 0.0
) -> Array | None:
    """Return the shortest path of the disc among `obstacles`, (m, 2) [m], or None.

    Args:
        scene: Workspace, start, goal and robot.
        obstacles: Those that stand in the way; the scene's others are ignored.
        margin_m: Clearance kept beyond the disc's radius.
    """
    footprints = Footprints.stack([o.footprint for o in obstacles])
    return shortest_path(
        np.array(scene.start_m),
        np.array(scene.goal_m),
        footprints,
        scene.robot.radius_m + margin_m,
        scene.workspace_m,
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
    free: Array | None = None
    if connected_outer(scene, everything):
        free = free_path(scene, everything)
        if free is None or free_path(scene, everything, margin_m) is None:
            return None
    limit = scene.robot.force_max_n
    reference = free_path(scene, [o for o in everything if not o.pushable(limit)])
    if reference is None:
        return None
    return Certificate(
        collision_free_length_m=None
        if free is None
        else round(polyline_length(free), 6),
        reference_length_m=round(polyline_length(reference), 6),
        straight_line_m=round(norm(np.subtract(scene.goal_m, scene.start_m)), 6),
        door_ids=_door_ids(scene, free, reference, margin_m),
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


def _door_ids(
    scene: Scene, free: Array | None, reference: Array, margin_m: float
) -> tuple[str, ...]:
    """Return the candidates whose removal alone opens a way, or shortens it by 10 %."""
    doors = door_candidates(scene)
    if free is not None:
        swept = shapely.LineString(reference).buffer(scene.robot.radius_m)
        doors = [o for o in doors if swept.intersects(o.outline)]
    longest = np.inf if free is None else 0.9 * polyline_length(free)
    found = []
    for door in doors:
        others = [o for o in scene.obstacles if o is not door]
        way = free_path(scene, others, margin_m)
        if way is not None and polyline_length(way) < longest:
            found.append(door.id)
    return tuple(found)
