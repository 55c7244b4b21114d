"""What a room is like in the morning, where it stays as it was left.

Every obstacle stays where it came to rest, fallen or upright, and what is broken stays
broken. Only what stands on the next start or goal is put back into its own place, and
with it whatever stands in that place.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import msgspec
import shapely

from beacon_mj.geometry import Footprint
from beacon_mj.scene import Scene

if TYPE_CHECKING:
    from beacon_mj.world.base import BaseWorld

ROOM_M = 0.02  #: Gap to the robot below which something stands on its start [m].
_APART_M = 1e-3  #: Gap below which two obstacles stand in one place [m].

Pose = tuple[float, float, float, float, float, float, float]


class Left(msgspec.Struct, frozen=True, kw_only=True):
    """A room as it was left.

    Attributes:
        poses: Position [m] and quaternion (wxyz) by obstacle id; what is not named
            stands where the scene has it.
        broken: Ids of what is broken.
    """

    poses: Mapping[str, Pose] = {}
    broken: tuple[str, ...] = ()


def as_left(world: "BaseWorld", scene: Scene) -> Left:
    """Return how the next day finds a world.

    Args:
        world: The world at the end of the day; what still moves stops there.
        scene: The next day's, with the same obstacles.
    """
    obstacles, outlines = scene.obstacles, world.outlines
    home = _put_back(outlines, scene)
    return Left(
        poses={
            o.id: _pose(pose)
            for i, (o, pose) in enumerate(zip(obstacles, world.poses, strict=True))
            if not o.fixed and i not in home
        },
        broken=tuple(o.id for i, o in enumerate(obstacles) if world.broken[i]),
    )


def _put_back(outlines: Sequence[Footprint], scene: Scene) -> set[int]:
    """Return which obstacles go back into their own places."""
    ends = shapely.MultiPoint([scene.start_m, scene.goal_m])
    free = [i for i, o in enumerate(scene.obstacles) if not o.fixed]
    left = {i: outlines[i].polygon() for i in free}
    near_m = scene.robot.radius_m + ROOM_M
    back = {i for i in free if left[i].distance(ends) < near_m}
    while True:
        places = [scene.obstacles[i].outline for i in back]
        also = {
            i
            for i in free
            if i not in back and any(left[i].distance(p) < _APART_M for p in places)
        }
        if not also:
            return back
        back |= also


def _pose(values: Sequence[float]) -> Pose:
    x, y, z, qw, qx, qy, qz = (float(v) for v in values)
    return x, y, z, qw, qx, qy, qz
