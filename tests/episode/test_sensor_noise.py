"""Errors of the robot's own position and of what it feels."""

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest

from beacon_mj.episode.episode import make_task
from beacon_mj.episode.protocol import PRESETS, Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.sensor import Sensor
from beacon_mj.episode.sensor_noise import CORRELATION_S, ForceGain, PoseError
from beacon_mj.errors import RunError
from beacon_mj.fidelity.benches import bench, block
from beacon_mj.geometry import Array
from beacon_mj.interface import Observation
from beacon_mj.planners.clairvoyant import Clairvoyant
from beacon_mj.planners.semantic import Semantic
from beacon_mj.recording import Recorder, read_log, verify
from beacon_mj.recording.rebuild import rebuild_trace
from beacon_mj.scene import Scene, Sensing
from beacon_mj.world import World
from tests.worlds import cached_scene

REALISTIC = Protocol.preset("realistic")


def drive(scene: Scene, protocol: Protocol, steps: int = 60) -> list[Observation]:
    """Return what is observed along one drive, in a world of its own."""
    world = World(scene)
    sensor = Sensor(world, protocol)
    seen = [sensor.observe(None, 1.0)]
    for _ in range(steps):
        seen.append(sensor.observe(world.step(np.array([0.4, 0.05])), 1.0))
    return seen


def positions(scene: Scene, protocol: Protocol) -> Array:
    return np.array([o.position_m for o in drive(scene, protocol)])


def test_the_error_of_the_position_is_the_process_that_is_stated() -> None:
    sigma, lag = 0.03, 40
    errors = []
    for index in range(150):
        scene = msgspec.structs.replace(bench(), index=index)
        process = PoseError(scene, sigma)
        errors.append([process.next_m() for _ in range(2 * lag)])
    e = np.array(errors)  # (episodes, steps, 2)
    period = bench().robot.control_period_s
    kept = math.exp(-lag * period / CORRELATION_S)
    for start in (0, lag - 1):
        now, later = e[:, start], e[:, start + lag]
        assert now.std() == pytest.approx(sigma, rel=0.1)
        correlation = (now * later).mean() / sigma**2
        assert correlation == pytest.approx(kept, abs=0.15)
        innovation = later - kept * now
        expected = sigma * math.sqrt(1.0 - kept * kept)
        assert innovation.std() == pytest.approx(expected, rel=0.1)
    assert np.abs(e.mean(axis=(0, 1))).max() < 0.1 * sigma


def test_the_gain_of_the_force_sensor_is_about_one() -> None:
    gain = ForceGain(bench(), 0.1)
    drawn = np.array([gain.next() for _ in range(4000)])
    assert drawn.mean() == pytest.approx(1.0, abs=0.006)
    assert drawn.std() == pytest.approx(0.1, rel=0.05)
    wild = ForceGain(bench(), 3.0)
    assert min(wild.next() for _ in range(50)) == 0.0


def test_a_robot_that_is_wrong_about_itself_sees_everything_off_by_as_much() -> None:
    scene = cached_scene("cluttered", 0)
    plain = drive(scene, Protocol(pose_noise_m=0.01))
    lost = drive(scene, Protocol(pose_noise_m=0.01, robot_pose_noise_m=0.05))
    off = np.array(
        [b.position_m - a.position_m for a, b in zip(plain, lost, strict=True)]
    )
    assert off.std() > 0.01
    seen = 0
    for now, then, error in zip(plain, lost, off, strict=True):
        for a, b in zip(now.obstacles, then.obstacles, strict=True):
            assert (a.id, a.visible) == (b.id, b.visible)
            if a.visible:
                seen += 1
                np.testing.assert_allclose(
                    b.footprint.vertices, a.footprint.vertices + error, atol=1e-12
                )
                np.testing.assert_allclose(
                    b.centroid_m, a.centroid_m + error, atol=1e-12
                )
    assert seen > 100
    np.testing.assert_array_equal(
        [o.velocity_mps for o in plain], [o.velocity_mps for o in lost]
    )


def test_what_is_felt_has_one_gain_in_a_step() -> None:
    scene = bench(block("crate", 0.05, mass_kg=30.0))
    plain = drive(scene, Protocol(), 20)
    felt = drive(scene, Protocol(force_noise=0.1), 20)
    gains = []
    for a, b in zip(plain, felt, strict=True):
        assert [e.evidence for e in a.evidence] == [e.evidence for e in b.evidence]
        pairs = [*zip(a.contacts, b.contacts, strict=True)]
        for c, d in pairs:
            gain = d.force_n / c.force_n
            gains.append(gain)
            np.testing.assert_array_equal(c.normal, d.normal)
            np.testing.assert_allclose(b.bumper_force_n, gain * a.bumper_force_n)
            for e, f in zip(a.evidence, b.evidence, strict=True):
                assert f.force_n == pytest.approx(gain * e.force_n)
    assert len({round(gain, 9) for gain in gains}) > 5


@pytest.mark.parametrize("zero", [0.0, None])
def test_without_errors_nothing_is_drawn(zero: float | None) -> None:
    scene = cached_scene("collision-required", 0)
    protocol = Protocol(missed_detection=0.2, robot_pose_noise_m=zero, force_noise=zero)
    trace = run_episode(scene, Semantic(), protocol=protocol)
    plain = run_episode(scene, Semantic(), protocol=Protocol(missed_detection=0.2))
    assert len(trace.steps) == len(plain.steps) > 50
    for a, b in zip(trace.steps, plain.steps, strict=True):
        np.testing.assert_array_equal(a.outcome.position_m, b.outcome.position_m)


def test_errors_are_the_same_whenever_an_episode_is_run_and_differ_by_scene() -> None:
    protocol = Protocol(robot_pose_noise_m=0.02)
    one, other = (cached_scene("sparse", i) for i in (0, 1))
    np.testing.assert_array_equal(positions(one, protocol), positions(one, protocol))
    first = positions(one, protocol)[0] - np.array(one.start_m)
    second = positions(other, protocol)[0] - np.array(other.start_m)
    assert not np.allclose(first, second, atol=1e-4)


def test_the_goal_is_where_it_truly_is() -> None:
    scene = cached_scene("sparse", 0)
    trace = run_episode(scene, Semantic(), protocol=Protocol(robot_pose_noise_m=0.05))
    gaps = [
        math.dist(r.outcome.position_m, scene.goal_m) - trace.protocol.goal_tolerance_m
        for r in trace.steps
    ]
    assert trace.outcome == "reached"
    assert gaps[-1] <= 0.0 < min(gaps[:-1])
    np.testing.assert_array_equal(trace.start_m, scene.start_m)


def test_the_clairvoyant_rehearses_in_the_world_as_it_is() -> None:
    scene = cached_scene("collision-required", 1)
    told, lost = (
        run_episode(scene, Clairvoyant(), protocol=p) for p in (Protocol(), REALISTIC)
    )
    assert told.outcome == lost.outcome == "reached"
    assert len(told.steps) == len(lost.steps)


def test_a_log_holds_the_truth_and_what_the_planner_was_told(tmp_path: Path) -> None:
    path = tmp_path / "lost.mcap"
    scene = cached_scene("collision-required", 0)
    live = run_episode(
        scene, Semantic(), protocol=REALISTIC, listeners=[Recorder(path)]
    )
    assert verify(path).problem is None
    log = read_log(path)
    again = rebuild_trace(log)
    np.testing.assert_array_equal(again.start_m, live.start_m)
    told, steps = log.messages["/told"], log.messages["/step"]
    assert len(told) == len(steps) == len(live.steps) + 1
    off = [
        math.hypot(t.position_m.x - s.position_m.x, t.position_m.y - s.position_m.y)
        for (_, t), (_, s) in zip(told, steps, strict=True)
    ]
    assert 0.001 < min(off[1:]) + max(off) < 0.2
    for (_, t), (_, s) in zip(told, steps, strict=True):
        true = math.hypot(s.bumper_force_n.x, s.bumper_force_n.y)
        felt = math.hypot(t.bumper_force_n.x, t.bumper_force_n.y)
        assert felt == pytest.approx(true, rel=0.6)
    assert any(t.contacts for _, t in told)
    assert any(t.evidence for _, t in told)


def test_a_log_without_errors_says_nothing_twice(tmp_path: Path) -> None:
    path = tmp_path / "plain.mcap"
    run_episode(cached_scene("sparse", 0), Semantic(), listeners=[Recorder(path)])
    assert not read_log(path).messages["/told"]


def test_presets() -> None:
    assert Protocol.preset("paper") == Protocol()
    for name, values in PRESETS.items():
        preset = Protocol.preset(name)
        for field in Protocol.__struct_fields__:
            default = getattr(Protocol(), field)
            assert getattr(preset, field) == values.get(field, default)
        assert preset.certain() == Protocol().certain()
    with pytest.raises(RunError, match=r"'real'.*paper, realistic"):
        Protocol.preset("real")


def test_the_task_states_the_data_sheet() -> None:
    scene = cached_scene("cluttered", 0)
    sheet = make_task(scene, REALISTIC, 0).sensor
    assert (sheet.range_m, sheet.occlusion) == (1.0, True)
    for field in ("pose_noise_m", "missed_detection", "robot_pose_noise_m"):
        assert getattr(sheet, field) == PRESETS["realistic"][field]
    assert sheet.force_noise == PRESETS["realistic"]["force_noise"]
    own = Sensing(robot_pose_noise_m=0.03, force_noise=0.2)
    family = msgspec.structs.replace(scene, sensing=own)
    sheet = make_task(family, Protocol(force_noise=0.0), 0).sensor
    assert (sheet.robot_pose_noise_m, sheet.force_noise) == (0.03, 0.0)
