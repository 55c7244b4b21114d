"""Messages of ROS 2, made from those of a log; needs the package `rosbags`."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from beacon_mj.numerics import rotated
from beacon_mj.recording.drawing import ARENA, NS, ROBOT_FRAME

STORE: Any = get_typestore(Stores.ROS2_JAZZY)
LIDAR_FRAME = "lidar"  #: Moves with the robot and does not turn.
ARROW, CUBE, SPHERE, CYLINDER, TRIANGLES = 0, 1, 2, 3, 11  #: Kinds of a Marker.


def make(name: str, *values: Any) -> Any:
    """Return a message such as `nav_msgs/Path` from its fields in order."""
    package, _, kind = name.partition("/")
    return STORE.types[f"{package}/msg/{kind}"](*values)


def stamp(time_ns: int) -> Any:
    """Return a simulation time."""
    return make("builtin_interfaces/Time", *divmod(time_ns, NS))


def header(time_ns: int, frame: str = ARENA) -> Any:
    """Return a header of the arena, or of another frame."""
    return make("std_msgs/Header", stamp(time_ns), frame)


def transforms(poses: Mapping[str, Any], time_ns: int) -> Any:
    """Return the transforms of all frames; values are `foxglove.FrameTransform`."""
    return make(
        "tf2_msgs/TFMessage",
        [
            make(
                "geometry_msgs/TransformStamped",
                header(time_ns),
                frame,
                make(
                    "geometry_msgs/Transform",
                    _vector(found.translation),
                    _quaternion(found.rotation),
                ),
            )
            for frame, found in poses.items()
        ],
    )


def odometry(step: Any, rotation: Any, turn_rate: float, time_ns: int) -> Any:
    """Return pose and velocity of the robot, the velocity in its own frame.

    Args:
        step: The step's message.
        rotation: Orientation of its frame, as in `/tf`.
        turn_rate: How fast that turns [rad/s].
        time_ns: When [ns].
    """
    position = make("geometry_msgs/Point", step.position_m.x, step.position_m.y, 0.0)
    turning = make("geometry_msgs/Vector3", 0.0, 0.0, turn_rate)
    velocity = np.array([step.velocity_mps.x, step.velocity_mps.y])
    if rotation.z:
        velocity = rotated(velocity, -2.0 * math.atan2(rotation.z, rotation.w))
    linear = make("geometry_msgs/Vector3", *velocity.tolist(), 0.0)
    exact = np.zeros(36)
    return make(
        "nav_msgs/Odometry",
        header(time_ns),
        ROBOT_FRAME,
        make(
            "geometry_msgs/PoseWithCovariance",
            make("geometry_msgs/Pose", position, _quaternion(rotation)),
            exact,
        ),
        make(
            "geometry_msgs/TwistWithCovariance",
            make("geometry_msgs/Twist", linear, turning),
            exact,
        ),
    )


def path(plan: Any, time_ns: int) -> Any:
    """Return a planned path."""
    return make(
        "nav_msgs/Path",
        header(time_ns),
        [
            make("geometry_msgs/PoseStamped", header(time_ns), _pose(pose))
            for pose in plan.poses
        ],
    )


def lidar_frame(scan: Any, time_ns: int) -> Any:
    """Return where the lidar is; `scan` is a `foxglove.LaserScan`."""
    place, upright = scan.pose.position, scan.pose.orientation
    pose = make("geometry_msgs/Transform", _vector(place), _quaternion(upright))
    frame = make("geometry_msgs/TransformStamped", header(time_ns), LIDAR_FRAME, pose)
    return make("tf2_msgs/TFMessage", [frame])


def laser_scan(scan: Any, range_m: float, period_s: float, time_ns: int) -> Any:
    """Return a scan, all beams of one moment; infinity where nothing came back.

    Args:
        scan: A `foxglove.LaserScan`.
        range_m: Range of the lidar [m].
        period_s: Time from one scan to the next [s].
        time_ns: When it was taken [ns].
    """
    ranges = np.array(scan.ranges, np.float32)
    step = scan.end_angle / max(len(ranges) - 1, 1)
    return make(
        "sensor_msgs/LaserScan",
        header(time_ns, LIDAR_FRAME),
        scan.start_angle,
        scan.end_angle,
        step,
        0.0,
        period_s,
        0.0,
        range_m,
        ranges,
        np.zeros(0, np.float32),
    )


def clock(time_ns: int) -> Any:
    """Return the simulation time."""
    return make("rosgraph_msgs/Clock", stamp(time_ns))


def markers(update: Any, time_ns: int) -> Any:
    """Return a scene update as markers: one namespace for each entity."""
    return make(
        "visualization_msgs/MarkerArray",
        [m for entity in update.entities for m in _of_entity(entity, time_ns)],
    )


def _of_entity(entity: Any, time_ns: int) -> list[Any]:
    shapes = [
        *((CUBE, c, c.size) for c in entity.cubes),
        *((SPHERE, s, s.size) for s in entity.spheres),
        *((CYLINDER, c, c.size) for c in entity.cylinders),
        *((TRIANGLES, t, None) for t in entity.triangles),
        *((ARROW, a, _arrow_size(a)) for a in entity.arrows),
    ]
    return [
        _marker(entity, number, kind, shape, size, time_ns)
        for number, (kind, shape, size) in enumerate(shapes)
    ]


def _marker(
    entity: Any, number: int, kind: int, shape: Any, size: Any, time_ns: int
) -> Any:
    """Return one primitive as a marker, locked to the frame of its entity."""
    whole = make("geometry_msgs/Vector3", 1.0, 1.0, 1.0)
    nothing = np.zeros(0, np.uint8)
    unstamped = header(0, "")
    return make(
        "visualization_msgs/Marker",
        header(time_ns, entity.frame_id),
        entity.id,
        number,
        kind,
        0,  # Add, or replace the one of the same name and number.
        _pose(shape.pose),
        whole if size is None else _vector(size),
        make("std_msgs/ColorRGBA", *(getattr(shape.color, c) for c in "rgba")),
        make(
            "builtin_interfaces/Duration",
            entity.lifetime.seconds,
            entity.lifetime.nanos,
        ),
        True,
        _corners(shape) if kind == TRIANGLES else [],
        [],
        "",
        make("sensor_msgs/CompressedImage", unstamped, "", nothing),
        [],
        "",
        "",
        make("visualization_msgs/MeshFile", "", nothing),
        False,
    )


def _corners(shape: Any) -> list[Any]:
    """Return the corners of all triangles, three for each."""
    points = [_point(p) for p in shape.points]
    return [points[k] for k in shape.indices]


def _arrow_size(arrow: Any) -> Any:
    """Return the scale of a marker's arrow: length, width, height."""
    length = arrow.shaft_length + arrow.head_length
    return make(
        "geometry_msgs/Vector3", length, arrow.head_diameter, arrow.head_diameter
    )


def _pose(pose: Any) -> Any:
    return make(
        "geometry_msgs/Pose", _point(pose.position), _quaternion(pose.orientation)
    )


def _point(found: Any) -> Any:
    return make("geometry_msgs/Point", found.x, found.y, found.z)


def _vector(found: Any) -> Any:
    return make("geometry_msgs/Vector3", found.x, found.y, found.z)


def _quaternion(found: Any) -> Any:
    return make("geometry_msgs/Quaternion", found.x, found.y, found.z, found.w)
