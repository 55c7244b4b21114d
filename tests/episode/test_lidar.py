"""What a planner gets of the lidar, and what it gets where that is all there is."""

import dataclasses
import math

import msgspec
import numpy as np
import pytest

from beacon_mj.episode.episode import make_task
from beacon_mj.episode.lidar import Scanner
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.sealed import Sealer
from beacon_mj.episode.sensor import Sensor
from beacon_mj.eval.runs.isolation.wire import Changes, Picture
from beacon_mj.fidelity.benches import bench, block
from beacon_mj.geometry import Array
from beacon_mj.interface import Command, Observation, Scan, SensorSheet, Task
from beacon_mj.planners.base import Planner
from beacon_mj.planners.push_through import PushThrough
from beacon_mj.planners.registry import OURS, PAPER, load_planner
from beacon_mj.recording.provenance import to_json
from beacon_mj.scene import Scene
from beacon_mj.world import World
from tests.worlds import cached_scene

LIDAR = Protocol(lidar_beams=90, lidar_noise_m=0.02, lidar_dropout=0.1)
ALONE = Protocol(lidar_beams=90, obstacles="none", max_steps=60)


def watch(
    scene: Scene, protocol: Protocol, steps: int = 40, east: float = 0.35
) -> list[Observation]:
    """Return what is observed along one drive, to the north-east unless told."""
    world = World(scene)
    sensor = Sensor(world, protocol)
    seen = [sensor.observe(None, 1.0)]
    for _ in range(steps):
        seen.append(sensor.observe(world.step(np.array([east, 0.7 - east])), 1.0))
    return seen


def ranges(scene: Scene, protocol: Protocol, steps: int = 40) -> Array:
    scans = [o.scan for o in watch(scene, protocol, steps)]
    return np.array([s.ranges_m for s in scans if s is not None])


def test_there_is_no_lidar_unless_asked_for() -> None:
    scene = cached_scene("cluttered", 0)
    assert watch(scene, Protocol(), 1)[1].scan is None
    assert watch(scene, Protocol(lidar_beams=0), 1)[1].scan is None
    assert make_task(scene, Protocol(), 0).sensor.lidar_beams == 0


def test_a_protocol_without_lidar_is_written_as_before() -> None:
    assert "lidar" not in to_json(Protocol())
    assert "obstacles" not in to_json(Protocol())
    text = to_json(ALONE)
    assert msgspec.json.decode(text, type=Protocol) == ALONE
    assert msgspec.json.decode(to_json(Protocol()), type=Protocol) == Protocol()


def test_noise_and_dropouts_are_those_of_the_sheet() -> None:
    scene = cached_scene("cluttered", 1)
    exact = ranges(scene, Protocol(lidar_beams=90))
    found = ranges(scene, LIDAR)
    assert found.shape == exact.shape == (41, 90)
    both = np.isfinite(exact) & np.isfinite(found)
    both &= exact < 3.4  # Near the range, those that come out too long are lost.
    errors = found[both] - exact[both]
    assert errors.std() == pytest.approx(0.02, rel=0.1)
    assert abs(errors.mean()) < 0.002
    lost = np.isinf(found)[exact < 3.4].mean()
    assert lost == pytest.approx(0.1, abs=0.02)
    assert found.min() >= 0.0
    assert found[np.isfinite(found)].max() <= 3.5


def test_each_error_has_a_stream_of_its_own() -> None:
    scene = cached_scene("cluttered", 1)
    noisy = ranges(scene, msgspec.structs.replace(LIDAR, lidar_dropout=0.0))
    lossy = ranges(scene, msgspec.structs.replace(LIDAR, lidar_noise_m=0.0))
    both = ranges(scene, LIDAR)
    kept = np.isfinite(both)
    np.testing.assert_array_equal(both[kept], noisy[kept])
    # A beam near the range may also be lost to noise.
    assert (np.isinf(both) | np.isfinite(lossy)).all()


def test_the_same_scene_gives_the_same_scans() -> None:
    scene = cached_scene("cluttered", 1)
    assert ranges(scene, LIDAR).tobytes() == ranges(scene, LIDAR).tobytes()
    other = msgspec.structs.replace(scene, index=77)
    assert ranges(other, LIDAR).tobytes() != ranges(scene, LIDAR).tobytes()


def test_the_lidar_disturbs_no_other_sense() -> None:
    """Nor does it disturb the physics: both drives see the same, step by step."""
    scene = cached_scene("collision-required", 0)
    noise = Protocol(missed_detection=0.3, pose_noise_m=0.02, force_noise=0.1)
    with_scan = msgspec.structs.replace(
        noise, lidar_beams=30, lidar_noise_m=0.02, lidar_dropout=0.1
    )
    for a, b in zip(watch(scene, noise), watch(scene, with_scan), strict=True):
        assert b.scan is not None
        assert a.position_m.tobytes() == b.position_m.tobytes()
        assert a.footprints.vertices.tobytes() == b.footprints.vertices.tobytes()
        assert a.bumper_force_n.tobytes() == b.bumper_force_n.tobytes()
        assert [o.visible for o in a.obstacles] == [o.visible for o in b.obstacles]


def test_points_are_where_things_are() -> None:
    """On the outline of something, or on a wall."""
    scene = bench(block("crate", 0.6))
    seen = watch(scene, Protocol(lidar_beams=64, lidar_range_m=10.0), 0)[0]
    assert seen.scan is not None
    points = seen.scan.points_m(seen.position_m)
    assert points.shape == (64, 2)
    world = World(scene)
    gaps = np.abs(world.footprints.distances(points)).min(axis=1)
    walls = np.minimum(points, 6.0 - points).min(axis=1)
    assert np.minimum(gaps, np.abs(walls)).max() < 1e-3
    assert (gaps < 1e-3).sum() > 3
    np.testing.assert_allclose(seen.scan.angles_rad[16], math.pi / 2)


def test_a_planner_gets_a_copy_that_it_cannot_write_to() -> None:
    seen = watch(cached_scene("cluttered", 0), LIDAR, 1)[1]
    sealed = Sealer().observation(seen)
    assert seen.scan is not None
    assert sealed.scan is not None
    np.testing.assert_array_equal(sealed.scan.ranges_m, seen.scan.ranges_m)
    assert not np.shares_memory(sealed.scan.ranges_m, seen.scan.ranges_m)
    with pytest.raises(ValueError, match="read-only"):
        sealed.scan.ranges_m[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        sealed.scan.range_max_m = 1.0  # type: ignore[misc]


def test_the_scan_reaches_an_isolated_planner() -> None:
    changes, picture = Changes(), Picture()
    for seen in watch(cached_scene("cluttered", 0), LIDAR, 3):
        told = picture.observation(changes.request(0, seen))
        assert seen.scan is not None
        assert told.scan is not None
        assert told.scan.ranges_m.tobytes() == seen.scan.ranges_m.tobytes()
        assert told.scan.range_max_m == seen.scan.range_max_m


def test_where_obstacles_are_not_perceived_touch_has_no_name() -> None:
    scene = bench(block("crate", 0.05))
    felt = 0
    for seen in watch(scene, Protocol(obstacles="none"), 30, east=0.7):
        assert seen.obstacles == ()
        assert len(seen.footprints) == 0
        assert seen.map_version == 0
        assert seen.evidence == ()
        for contact in seen.contacts:
            felt += 1
            assert contact.id == ""
            assert contact.force_n > 0.0
            assert contact.normal[0] > 0.5
    assert felt > 3
    told = watch(scene, Protocol(), 30, east=0.7)
    assert any(o.evidence for o in told)


class Eyes(Planner):
    """Drives where most room is, within a right angle of the goal."""

    def reset(self, task: Task) -> None:
        self.task = task

    def act(self, observation: Observation) -> Command:
        scan = observation.scan
        assert scan is not None
        assert observation.obstacles == ()
        to_goal = self.task.goal_m - observation.position_m
        bearing = math.atan2(to_goal[1], to_goal[0])
        turn = np.abs((scan.angles_rad - bearing + math.pi) % math.tau - math.pi)
        room = np.minimum(scan.ranges_m, 1.0) - 0.5 * turn
        heading = scan.angles_rad[int(np.argmax(room))]
        direction = np.array([math.cos(heading), math.sin(heading)])
        return Command(velocity_mps=0.4 * direction)


def test_an_episode_by_scan_alone() -> None:
    scene = cached_scene("sparse", 0)
    trace = run_episode(scene, Eyes(), protocol=ALONE)
    assert trace.outcome == "timeout"
    assert len(trace.steps) == 60
    assert trace.first_sensed == ()
    assert not any(step.newly_sensed for step in trace.steps)


def test_a_planner_that_ignores_scans_runs_as_it_is() -> None:
    scene = cached_scene("sparse", 1)
    plain = run_episode(scene, PushThrough())
    blind = run_episode(scene, PushThrough(), protocol=Protocol(obstacles="none"))
    way = [[s.outcome.position_m.tobytes() for s in t.steps] for t in (plain, blind)]
    assert way[0] == way[1]
    assert plain.outcome == blind.outcome


@pytest.mark.parametrize("name", sorted({**PAPER, **OURS, "mppi": "", "namo": ""}))
def test_every_planner_that_ignores_scans_runs_without_outlines(name: str) -> None:
    """It drives into the barrier, and nothing fails."""
    scene = cached_scene("collision-required", 0)
    blind = Protocol(obstacles="none", max_steps=50)
    trace = run_episode(scene, load_planner(name)[1](), protocol=blind)
    assert trace.outcome == "timeout", trace.detail
    assert any(step.outcome.contacts for step in trace.steps)


def test_the_data_sheet_says_what_the_lidar_is() -> None:
    sheet = make_task(cached_scene("sparse", 0), LIDAR, 0).sensor
    assert (sheet.lidar_beams, sheet.lidar_range_m) == (90, 3.5)
    assert (sheet.lidar_noise_m, sheet.lidar_dropout) == (0.02, 0.1)
    assert sheet.obstacles == "perceived"
    assert make_task(cached_scene("sparse", 0), ALONE, 0).sensor.obstacles == "none"


def test_a_lidar_that_always_misses_sees_nothing() -> None:
    world = World(cached_scene("cluttered", 0))
    scan: Scan = Scanner(
        world, SensorSheet(lidar_beams=50, lidar_dropout=0.999999999)
    ).scan()
    assert np.isinf(scan.ranges_m).all()
    assert scan.points_m(world.position_m).shape == (0, 2)
