"""The lidar's scans in logs: written, read, proved, exported, drawn."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from mcap.records import McapRecord, Message

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.trace import StepRecord, Trace
from beacon_mj.errors import LogError
from beacon_mj.interface import Observation, Scan, beam_angles
from beacon_mj.recording import Recorder, read_log, verify
from beacon_mj.recording.container import Container
from beacon_mj.recording.messages import message
from beacon_mj.recording.scans import SCAN_TOPIC, scan_points
from beacon_mj.rendering.panel import panel_svg
from beacon_mj.world import BaseWorld, World
from tests.recording.samples import PushThrough, record, rewrite, row
from tests.worlds import cached_scene

LIDAR = Protocol(
    lidar_beams=48, lidar_noise_m=0.01, lidar_dropout=0.05, lidar_range_m=3.0,
    robot_pose_noise_m=0.05, max_steps=25,
)  # fmt: skip


class Witness:
    """Keeps what the planner was told, and where the robot was."""

    def __init__(self) -> None:
        self.scans: list[Scan] = []
        self.places: list[np.ndarray] = []

    def begin(self, trace: Trace, world: BaseWorld, observation: Observation) -> None:
        self._note(world, observation)

    def step(
        self, record: StepRecord, world: BaseWorld, observation: Observation
    ) -> None:
        self._note(world, observation)

    def end(self, trace: Trace) -> None:
        pass

    def _note(self, world: BaseWorld, observation: Observation) -> None:
        assert observation.scan is not None
        self.scans.append(observation.scan)
        self.places.append(world.position_m)


class Scanned(NamedTuple):
    path: Path
    live: Witness


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> Scanned:
    path, witness = tmp_path_factory.mktemp("scans") / "x.mcap", Witness()
    run_episode(
        cached_scene("cluttered", 2),
        PushThrough(),
        protocol=LIDAR,
        seed=3,
        listeners=[witness, Recorder(path, seed=3, row=row)],
    )
    return Scanned(path, witness)


def test_a_log_holds_every_scan_bit_for_bit(scanned: Scanned) -> None:
    log = read_log(scanned.path)
    found = log.messages[SCAN_TOPIC]
    assert [t for t, _ in found] == [t for t, _ in log.messages["/step"]]
    for (_, scan), live, place in zip(
        found, scanned.live.scans, scanned.live.places, strict=True
    ):
        assert np.array(scan.ranges).tobytes() == live.ranges_m.tobytes()
        assert (scan.pose.position.x, scan.pose.position.y) == tuple(place.tolist())
        angles = np.linspace(scan.start_angle, scan.end_angle, len(scan.ranges))
        np.testing.assert_allclose(angles, beam_angles(48), atol=1e-12)


def test_points_of_a_log_are_on_things(scanned: Scanned) -> None:
    log = read_log(scanned.path)
    live = scanned.live.scans[0].points_m(scanned.live.places[0])
    np.testing.assert_array_equal(scan_points(log, 0), live)
    world = World(log.scene)
    gaps = np.abs(world.footprints.distances(live)).min(axis=1)
    walls = np.abs(np.minimum(live, 6.0 - live)).min(axis=1)
    assert np.median(np.minimum(gaps, walls)) < 0.03


def test_verify_makes_the_scans_again(scanned: Scanned, tmp_path: Path) -> None:
    assert verify(scanned.path, row).problem is None
    forged = tmp_path / "forged.mcap"
    seen = 0

    def nearer(topic: str, r: McapRecord) -> McapRecord:
        nonlocal seen
        if topic == SCAN_TOPIC and isinstance(r, Message):
            seen += 1
            if seen == 7:
                scan = message("foxglove.LaserScan").FromString(r.data)
                k = next(k for k, r in enumerate(scan.ranges) if np.isfinite(r))
                scan.ranges[k] -= 1e-12
                r.data = scan.SerializeToString()
        return r

    rewrite(scanned.path, forged, nearer)
    problem = verify(forged, row).problem
    assert problem is not None
    assert SCAN_TOPIC in problem


@pytest.mark.parametrize("fault", ["lost", "short"])
def test_a_log_with_other_scans_is_refused(
    scanned: Scanned, tmp_path: Path, fault: str
) -> None:
    seen = 0

    def change(topic: str, r: McapRecord) -> McapRecord | None:
        nonlocal seen
        if topic == SCAN_TOPIC and isinstance(r, Message):
            seen += 1
            if seen == 4 and fault == "lost":
                return None
            if seen == 4:
                scan = message("foxglove.LaserScan").FromString(r.data)
                scan.ranges.pop()
                r.data = scan.SerializeToString()
        return r

    rewrite(scanned.path, tmp_path / "x.mcap", change)
    with pytest.raises(LogError, match="expected 26 scans of 48 beams but there are"):
        read_log(tmp_path / "x.mcap")


def test_a_log_without_lidar_has_no_such_topic(tmp_path: Path) -> None:
    record(tmp_path / "x.mcap", protocol=Protocol(max_steps=3))
    names = [getattr(r, "topic", "") for r in Container(tmp_path / "x.mcap").records()]
    assert "/step" in names
    assert SCAN_TOPIC not in names
    log = read_log(tmp_path / "x.mcap")
    assert log.messages[SCAN_TOPIC] == []
    assert scan_points(log, 0).shape == (0, 2)


def test_the_drawing_shows_the_last_scan(scanned: Scanned, tmp_path: Path) -> None:
    log = read_log(scanned.path)
    text = panel_svg(log)
    points = scan_points(log, log.steps)
    assert len(points) > 10
    for x, y in points.tolist():
        assert f'cx="{x:.4f}" cy="{y:.4f}" r="0.0200"' in text
    assert "lidar at the end" in text
    record(tmp_path / "plain.mcap", protocol=Protocol(max_steps=3))
    assert "lidar" not in panel_svg(read_log(tmp_path / "plain.mcap"))


def test_a_bag_holds_the_scans(scanned: Scanned, tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    from rosbags.highlevel import AnyReader

    from beacon_mj.recording.ros2 import export_ros2

    export_ros2(scanned.path, tmp_path / "bag")
    scans: list[tuple[int, Any]] = []
    frames: list[Any] = []
    with AnyReader([tmp_path / "bag"]) as reader:
        for connection, time_ns, data in reader.messages():
            found: Any = reader.deserialize(data, connection.msgtype)
            if connection.topic == SCAN_TOPIC:
                assert connection.msgtype == "sensor_msgs/msg/LaserScan"
                scans.append((time_ns, found))
            if connection.topic == "/tf":
                frames += [t for t in found.transforms if t.child_frame_id == "lidar"]
    live = scanned.live
    assert len(scans) == len(frames) == len(live.scans)
    for (_, found), frame, scan, place in zip(
        scans, frames, live.scans, live.places, strict=True
    ):
        assert found.header.frame_id == "lidar"
        assert found.range_max == pytest.approx(3.0)
        assert found.angle_increment == pytest.approx(2.0 * np.pi / 48)
        assert found.angle_max == pytest.approx(2.0 * np.pi * 47 / 48)
        np.testing.assert_array_equal(found.ranges, scan.ranges_m.astype(np.float32))
        assert (frame.transform.translation.x, frame.transform.translation.y) == tuple(
            place.tolist()
        )
