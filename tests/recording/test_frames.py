"""A viewer that jumps to any time shows every obstacle where it is then."""

from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from beacon_mj.geometry import Array
from beacon_mj.planners.base import Planner
from beacon_mj.planners.registry import load_planner
from beacon_mj.recording import read_log
from beacon_mj.recording.drawing import NS
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.world import World
from tests.recording.conftest import Sample
from tests.recording.samples import PushThrough, record

FAMILIES = ("cluttered", "collision-required", "collision-shortcut", "hard-shortcut")
LOGS = [(family, index) for family in FAMILIES for index in range(5)]
JUMPS = 20


class Viewer:
    """Transforms as Foxglove and Lichtblick keep them.

    A jump reads the last message of each topic, and one to the past forgets all
    transforms before. Between jumps every message is read.
    """

    def __init__(self, path: Path) -> None:
        self.now_ns = 0
        self.known: dict[str, dict[int, Any]] = defaultdict(dict)
        self.messages: dict[str, list[tuple[int, Any]]] = defaultdict(list)
        with path.open("rb") as file:
            reader = make_reader(file, decoder_factories=[DecoderFactory()])
            for schema, channel, found, decoded in reader.iter_decoded_messages():
                if schema is not None and schema.name == "foxglove.FrameTransforms":
                    self.messages[channel.topic].append((found.log_time, decoded))

    def jump(self, time_ns: int) -> None:
        if time_ns < self.now_ns:
            self.known.clear()
        self.now_ns = time_ns
        for found in self.messages.values():
            self._read([m for t, m in found if t <= time_ns][-1:])

    def play(self, time_ns: int) -> None:
        for found in self.messages.values():
            self._read([m for t, m in found if self.now_ns < t <= time_ns])
        self.now_ns = time_ns

    def pose(self, frame: str) -> list[float]:
        stamps = self.known[frame]
        t = stamps[max(s for s in stamps if s <= self.now_ns)]
        p, q = t.translation, t.rotation
        return [p.x, p.y, p.z, q.w, q.x, q.y, q.z]

    def _read(self, messages: list[Any]) -> None:
        for update in messages:
            for t in update.transforms:
                stamp_ns = t.timestamp.seconds * NS + t.timestamp.nanos
                self.known[t.child_frame_id][stamp_ns] = t


def _planner(index: int) -> Planner:
    return load_planner("beacon")[1]() if index % 2 else PushThrough()


def _poses(world: World, qpos: Array) -> Iterator[tuple[str, Array]]:
    """Yield the pose of each frame in a state, computed by MuJoCo."""
    world.data.qpos[:] = qpos
    mujoco.mj_kinematics(world.model, world.data)
    for o in world.scene.obstacles:
        body = world.model.body(o.id).id
        yield o.id, np.concatenate([world.data.xpos[body], world.data.xquat[body]])
    x, y, _ = world.data.body("base").xpos
    yield "robot", np.array([x, y, 0.0, 1.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(("family", "index"), LOGS)
def test_poses_after_a_jump_are_those_of_the_states(
    family: str, index: int, tmp_path: Path
) -> None:
    scene = generate_scene(family, index)
    trace = record(tmp_path / "x.mcap", scene, _planner(index))
    log, viewer = read_log(tmp_path / "x.mcap"), Viewer(tmp_path / "x.mcap")
    world = World(scene)
    ends_ns = np.array([t for t, _ in log.messages["/step"]])
    rng = np.random.default_rng(index)
    times = rng.integers(0, ends_ns[-1] + 1, JUMPS)
    assert (np.diff(times) > 0).any()
    assert (np.diff(times) < 0).any()
    for time_ns in times.tolist():
        viewer.jump(time_ns)
        for later_ns in (time_ns, time_ns + NS // 3):
            viewer.play(later_ns)
            step = int(np.searchsorted(ends_ns, later_ns, side="right")) - 1
            for frame, pose in _poses(world, log.positions[step]):
                assert np.abs(pose - viewer.pose(frame)).max() < 1e-9, frame
    if any(s.outcome.displacements for s in trace.steps):
        assert len(viewer.messages["/tf/moved"]) > 1


def test_obstacle_that_starts_to_move_is_written_where_it_rested(
    sample: Sample,
) -> None:
    """Else viewers, who interpolate, would let it creep from the start."""
    log = read_log(sample.path)
    rows: dict[str, list[int]] = defaultdict(list)
    for topic in ("/tf/start", "/tf/moved"):
        for _, update in log.messages[topic]:
            for t in update.transforms:
                rows[t.child_frame_id].append(
                    t.timestamp.seconds * NS + t.timestamp.nanos
                )
    moved = {d.obstacle for s in sample.trace.steps for d in s.outcome.displacements}
    assert moved
    for name in moved:
        assert rows[name] == sorted(rows[name])
        assert rows[name][0] == 0
        assert rows[name][2] - rows[name][1] == NS // 10
