"""A bag read back by rosbags' own reader holds what the log holds."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from beacon_mj import cli
from beacon_mj.errors import LogError
from beacon_mj.recording import Log, read_log
from tests.recording.conftest import Sample

rosbags = pytest.importorskip("rosbags")

from rosbags.highlevel import AnyReader  # noqa: E402

from beacon_mj.recording.ros2 import BAG_TOPICS, export_ros2  # noqa: E402

Bag = dict[str, list[tuple[int, Any]]]


@pytest.fixture(scope="module")
def log(damage: Sample) -> Log:
    return read_log(damage.path)


@pytest.fixture(scope="module")
def bag(damage: Sample, tmp_path_factory: pytest.TempPathFactory) -> Bag:
    folder = tmp_path_factory.mktemp("bags") / "x"
    count = export_ros2(damage.path, folder)
    assert sorted(p.name for p in folder.iterdir()) == ["metadata.yaml", "x.mcap"]
    assert [p.name for p in folder.parent.iterdir()] == ["x"]
    out: Bag = {}
    with AnyReader([folder]) as reader:
        assert {c.topic: c.msgtype for c in reader.connections} == BAG_TOPICS
        times = []
        for connection, time_ns, data in reader.messages():
            found = reader.deserialize(data, connection.msgtype)
            out.setdefault(connection.topic, []).append((time_ns, found))
            times.append(time_ns)
    assert times == sorted(times)
    assert len(times) == count
    return out


def _stamp(time: Any) -> int:
    return int(time.sec) * 1_000_000_000 + int(time.nanosec)


def test_clock_ticks_with_the_simulation(bag: Bag, log: Log) -> None:
    assert [t for t, _ in bag["/clock"]] == [t for t, _ in log.messages["/step"]]
    assert all(_stamp(m.clock) == t for t, m in bag["/clock"])


def test_odometry_is_the_robots_way(bag: Bag, damage: Sample) -> None:
    positions = [
        (m.pose.pose.position.x, m.pose.pose.position.y) for _, m in bag["/odom"]
    ]
    speeds = [(m.twist.twist.linear.x, m.twist.twist.linear.y) for _, m in bag["/odom"]]
    steps = damage.trace.steps
    live = [damage.trace.start_m, *(s.outcome.position_m for s in steps)]
    np.testing.assert_array_equal(positions, live)
    np.testing.assert_array_equal(speeds[1:], [s.outcome.velocity_mps for s in steps])
    frames = {(m.header.frame_id, m.child_frame_id) for _, m in bag["/odom"]}
    assert frames == {("arena", "robot")}


def test_transforms_have_every_frame_at_every_step(bag: Bag, log: Log) -> None:
    names = {"robot", *(o.id for o in log.scene.obstacles)}
    topics = [log.messages[t] for t in ("/tf", "/tf/start", "/tf/moved")]
    for time_ns, found in bag["/tf"]:
        assert {_stamp(t.header.stamp) for t in found.transforms} == {time_ns}
        known: dict[str, Any] = {}
        for update in [m for topic in topics for t, m in topic if t <= time_ns]:
            known |= {t.child_frame_id: t for t in update.transforms}
        poses = {t.child_frame_id: t.transform for t in found.transforms}
        assert poses.keys() == known.keys() == names
        for name, pose in poses.items():
            assert pose.translation.x == known[name].translation.x
            assert pose.rotation.w == known[name].rotation.w


def test_plan_is_the_path(bag: Bag, log: Log) -> None:
    assert len(bag["/plan"]) == len(log.messages["/plan"]) > 0
    for (_, ours), (_, theirs) in zip(bag["/plan"], log.messages["/plan"], strict=True):
        points = [(p.pose.position.x, p.pose.position.y) for p in ours.poses]
        assert points == [(p.position.x, p.position.y) for p in theirs.poses]


def test_markers_draw_every_obstacle_and_the_forces(bag: Bag, log: Log) -> None:
    first = bag["/markers"][0][1].markers
    names = {m.ns for m in first}
    assert names == {"arena", "robot", *(o.id for o in log.scene.obstacles)}
    assert all(m.header.frame_id == m.ns and m.frame_locked for m in first)
    assert len({(m.ns, m.id) for m in first}) == len(first)
    for marker in first:
        assert marker.color.a > 0.0
        assert min(marker.scale.x, marker.scale.y, marker.scale.z) > 0.0
        assert (len(marker.points) > 0) == (marker.type == marker.TRIANGLE_LIST)
        assert len(marker.points) % 3 == 0
    arrows = [m for _, a in bag["/markers"] for m in a.markers if m.type == m.ARROW]
    assert len(arrows) > 3
    assert all(_stamp(m.lifetime) > 0 for m in arrows)


def test_command_writes_a_bag_once(
    damage: Sample, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["export", str(damage.path), "--ros2", str(tmp_path / "bag")]
    assert cli.run(arguments) == 0
    assert "messages" in capsys.readouterr().err
    assert cli.run(arguments) == 2
    assert "expected a new folder" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["bag"]


def test_unreadable_log_leaves_no_bag(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="cannot read"):
        export_ros2(tmp_path / "gone.mcap", tmp_path / "bag")
    assert not list(tmp_path.iterdir())
