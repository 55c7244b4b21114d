"""The scans of a lidar in a log: the topic `/scan`, there only if the robot has one."""

import math
from typing import Any

import numpy as np

from beacon_mj.geometry import Array
from beacon_mj.interface import Scan, beam_angles
from beacon_mj.recording.drawing import ARENA, stamp
from beacon_mj.recording.messages import message
from beacon_mj.recording.reader import Log
from beacon_mj.scene import Robot
from beacon_mj.world.lidar import scan_height_m

SCAN_TOPIC = "/scan"


def scan_message(scan: Scan, position_m: Array, robot: Robot, time_ns: int) -> Any:
    """Return a scan where it was taken: from the true centre of the robot.

    The scan's axes are the arena's. What no beam brought back is infinite.
    """
    angles = beam_angles(len(scan.ranges_m))
    out = message("foxglove.LaserScan")(
        frame_id=ARENA,
        start_angle=angles[0],
        end_angle=angles[-1],
        ranges=scan.ranges_m.tolist(),
    )
    stamp(out.timestamp, time_ns)
    place = out.pose.position
    place.x, place.y = position_m.tolist()
    place.z = scan_height_m(robot.height_m)
    out.pose.orientation.w = 1.0
    return out


def scan_points(log: Log, step: int) -> Array:
    """Return what the lidar hit at a control step, in the arena, shape (k, 2) [m].

    Args:
        log: The log; nothing was hit where the robot has no lidar.
        step: Control steps executed before; 0 is the start.
    """
    if not log.messages[SCAN_TOPIC]:
        return np.zeros((0, 2))
    _, found = log.messages[SCAN_TOPIC][step]
    scan = Scan(ranges_m=np.array(found.ranges), range_max_m=math.inf)
    return scan.points_m(np.array((found.pose.position.x, found.pose.position.y)))
