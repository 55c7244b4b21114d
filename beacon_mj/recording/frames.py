"""The poses of robot and obstacles as transforms, right after a jump as well.

A viewer that jumps to another time reads the last message of each topic and forgets the
rest. So no topic holds only what moved in one step: `/tf` is the robot, `/tf/start`
every obstacle, and `/tf/moved` every obstacle that has ever moved. The newest transform
of a frame is where it is.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.recording.drawing import ARENA, ROBOT_FRAME, Values, stamp
from beacon_mj.recording.messages import message


class Frames:
    """Follows the poses of one episode, from its start."""

    def __init__(self, ids: Sequence[str], poses: Array) -> None:
        """Begin with the poses at the start, shape (n, 7): position [m], then wxyz."""
        self._ids, self._poses = ids, poses
        self._moving = np.zeros(len(ids), np.bool_)
        self._ever = np.zeros(len(ids), np.bool_)
        self._since_ns = np.zeros(len(ids), np.int64)

    def start(self) -> Any:
        """Return the message of `/tf/start`."""
        out = message("foxglove.FrameTransforms")()
        for name, pose in zip(self._ids, self._poses, strict=True):
            _add(out, name, 0, pose)
        return out

    def moved(self, poses: Array, before_ns: int, time_ns: int) -> Any | None:
        """Return the message of `/tf/moved`, None if nothing moved.

        Each transform has the time since when it holds. Viewers interpolate between
        transforms, so an obstacle that starts to move is first written once more where
        it rested.

        Args:
            poses: The poses now, (n, 7).
            before_ns: Time of the poses of the last call [ns].
            time_ns: Time now [ns].
        """
        moving = (poses != self._poses).any(axis=1)
        started = np.flatnonzero(moving & ~self._moving).tolist()
        before, self._poses, self._moving = self._poses, poses, moving
        if not moving.any():
            return None
        self._ever |= moving
        self._since_ns[moving] = time_ns
        out = message("foxglove.FrameTransforms")()
        for i in started:
            _add(out, self._ids[i], before_ns, before[i])
        for i in np.flatnonzero(self._ever).tolist():
            _add(out, self._ids[i], int(self._since_ns[i]), poses[i])
        return out


def robot_transform(position_m: Array, time_ns: int, heading_rad: float = 0.0) -> Any:
    """Return the message of `/tf`: the robot."""
    out = message("foxglove.FrameTransforms")()
    x, y = position_m
    w, z = math.cos(0.5 * heading_rad), math.sin(0.5 * heading_rad)
    _add(out, ROBOT_FRAME, time_ns, (x, y, 0.0, w, 0.0, 0.0, z))
    return out


def obstacle_poses(
    messages: dict[str, list[tuple[int, Any]]],
) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield time [ns] and every obstacle's transform, at the start and when one moved.

    Args:
        messages: Times [ns] and messages of a log, by topic.
    """
    found: dict[str, Any] = {}
    for topic in ("/tf/start", "/tf/moved"):
        for time_ns, update in messages[topic]:
            found = found | {t.child_frame_id: t for t in update.transforms}
            yield time_ns, found


def _add(out: Any, frame: str, time_ns: int, pose: Values) -> None:
    t = out.transforms.add(parent_frame_id=ARENA, child_frame_id=frame)
    stamp(t.timestamp, time_ns)
    p, r = t.translation, t.rotation
    p.x, p.y, p.z, r.w, r.x, r.y, r.z = map(float, pose)
