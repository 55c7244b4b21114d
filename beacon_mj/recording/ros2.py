"""A log as a rosbag2 folder, written without ROS through the package `rosbags`.

Times are simulation time, as in the log. Transforms of all frames are written at every
step: ROS does not keep what is old.
"""

import tempfile
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.errors import WriterError

from beacon_mj.errors import LogError
from beacon_mj.recording import ros2_messages as ros
from beacon_mj.recording.frames import obstacle_poses
from beacon_mj.recording.reader import Log, read_log
from beacon_mj.recording.scans import SCAN_TOPIC
from beacon_mj.scene_gen.robots import robot_in

#: What each topic of the bag carries.
BAG_TOPICS = {
    "/clock": "rosgraph_msgs/msg/Clock",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/odom": "nav_msgs/msg/Odometry",
    "/plan": "nav_msgs/msg/Path",
    "/markers": "visualization_msgs/msg/MarkerArray",
}
#: The same of a robot with a lidar.
LIDAR_TOPICS = BAG_TOPICS | {SCAN_TOPIC: "sensor_msgs/msg/LaserScan"}


def export_ros2(log_path: str | Path, folder: str | Path) -> int:
    """Write a log as a rosbag2 folder with MCAP storage and the types of Jazzy.

    Args:
        log_path: The log, finished or not.
        folder: The bag; it must not exist, and is written whole or not at all.

    Returns:
        The number of messages written.

    Raises:
        LogError: If the log cannot be read or the bag not be written.
    """
    log, folder = read_log(log_path), Path(folder)
    if folder.exists():
        raise LogError(f"{folder}: expected a new folder but it exists.")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        # The file in a bag has the name of its folder, so that is the final one.
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".bag-") as part:
            count = _write(log, Path(part) / folder.name)
            (Path(part) / folder.name).rename(folder)
    except (OSError, WriterError) as error:
        raise LogError(f"{folder}: cannot write the bag: {error}.") from error
    return count


def _write(log: Log, folder: Path) -> int:
    count, topics = 0, bag_topics(log)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {
            topic: writer.add_connection(topic, kind, typestore=ros.STORE)
            for topic, kind in topics.items()
        }
        for time_ns, topic, found in sorted(_messages(log), key=lambda m: m[0]):
            data = ros.STORE.serialize_cdr(found, topics[topic])
            writer.write(connections[topic], time_ns, data)
            count += 1
    return count


def bag_topics(log: Log) -> dict[str, str]:
    """Return the topics of a log's bag, with the type of each."""
    return LIDAR_TOPICS if log.messages[SCAN_TOPIC] else BAG_TOPICS


def _messages(log: Log) -> Iterator[tuple[int, str, Any]]:
    """Yield (time [ns], topic, message), each topic in order."""
    turns = not robot_in(log.scene, log.protocol.robot).is_disc
    for k, (time_ns, step) in enumerate(log.messages["/step"]):
        rotation = log.messages["/tf"][k][1].transforms[0].rotation
        # The base's third joint, after two slides.
        rate = float(log.rates[k][2]) if turns else 0.0
        yield time_ns, "/clock", ros.clock(time_ns)
        yield time_ns, "/odom", ros.odometry(step, rotation, rate, time_ns)
    rest = deque(obstacle_poses(log.messages))
    for time_ns, found in log.messages["/tf"]:
        while rest and rest[0][0] <= time_ns:
            _, poses = rest.popleft()
        robot = {t.child_frame_id: t for t in found.transforms}
        yield time_ns, "/tf", ros.transforms(robot | poses, time_ns)
    for time_ns, plan in log.messages["/plan"]:
        yield time_ns, "/plan", ros.path(plan, time_ns)
    for topic in ("/scene", "/contacts/arrows"):
        for time_ns, update in log.messages[topic]:
            yield time_ns, "/markers", ros.markers(update, time_ns)
    range_m = log.protocol.sensor(log.scene).lidar_range_m
    period_s = log.scene.robot.control_period_s
    for time_ns, scan in log.messages[SCAN_TOPIC]:
        yield time_ns, "/tf", ros.lidar_frame(scan, time_ns)
        yield time_ns, SCAN_TOPIC, ros.laser_scan(scan, range_m, period_s, time_ns)
