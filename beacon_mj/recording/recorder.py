"""Writes one episode to one MCAP file while it runs.

Scene, world and configuration stand at the beginning of the file, and every simulated
second is flushed, so a run that is killed leaves a readable `.part` of all but its last
second. All times are simulation time: identical runs give identical bytes.
"""

import gzip
import hashlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Attachment, Channel, Metadata, Schema

from beacon_mj.episode.trace import StepRecord, Trace
from beacon_mj.errors import LogError, PlannerError
from beacon_mj.geometry import Array, Footprint
from beacon_mj.interface import Observation, PlannerInfo
from beacon_mj.recording import drawing, encoding, events, provenance
from beacon_mj.recording.container import PACKED
from beacon_mj.recording.drawing import NS
from beacon_mj.recording.frames import Frames, robot_transform
from beacon_mj.recording.labels import BeliefPicture, labels, rounded_belief
from beacon_mj.recording.machine import machine
from beacon_mj.recording.messages import schema_data
from beacon_mj.recording.scans import SCAN_TOPIC, scan_message
from beacon_mj.recording.schemas import SCENE_NAME, TOPICS, WORLD_NAME
from beacon_mj.recording.timeline import Timeline
from beacon_mj.recording.writer import LogWriter
from beacon_mj.world import BaseWorld


class Recorder:
    """Follows one episode and logs it; a `Listener` of `run_episode`."""

    def __init__(
        self,
        path: Path,
        *,
        planner_config: Any = None,
        seed: int = 0,
        row: Callable[[Trace], Mapping[str, Any]] | None = None,
    ) -> None:
        """Prepare to write `path`; nothing is written before the episode begins.

        Args:
            path: The finished log; its folder is created when missing.
            planner_config: The planner's configuration: anything msgspec can encode.
            seed: The planner's seed.
            row: Computes the episode's row, stored without its wall-clock columns.
        """
        self.path = Path(path)
        self._planner_config = planner_config
        self._seed = seed
        self._row = row
        self._writer: Any = None
        self._time_ns = 0

    def begin(self, trace: Trace, world: BaseWorld, observation: Observation) -> None:
        """Open the file and write everything known before the first decision."""
        with self._writing():
            self._open(trace, world)
            self._reset(world)
            self._put("/scene", drawing.scene_update(world, 0))
            self._put("/labels", labels(world))
            self._put("/tf/start", self._frames.start())
            self._log_poses(world, 0)
            self._log_state(world, 0)
            self._log_sensed(observation)
            self._log_scan(world, observation)
            self._put("/step", encoding.start_message(world, observation))
            self._writer.flush()

    def step(
        self, record: StepRecord, world: BaseWorld, observation: Observation
    ) -> None:
        """Write one control step; `/step` last, as the mark that it is whole."""
        time_ns = round(record.outcome.time_s * NS)
        with self._writing():
            self._log_decision(record)
            before, self._time_ns = self._time_ns, time_ns
            self._log_state(world, record.outcome.step)
            self._log_poses(world, before)
            self._log_sensed(observation)
            self._log_scan(world, observation)
            self._log_outcome(record, world)
            self._put("/step", encoding.step_message(record))
            if time_ns // NS > before // NS:
                self._writer.flush()

    def end(self, trace: Trace) -> None:
        """Write the result and give the file its final name."""
        row = None if self._row is None else self._row(trace)
        assert self._writer is not None, "end() before begin()"
        with self._writing():
            self._put("/log", events.ended(trace, self._time_ns))
            self._log_last_states()
            result = provenance.result(trace, row)
            self._writer.finish(Metadata("result", result))

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Leave the unfinished file closed when something goes wrong."""
        try:
            yield
        except BaseException as error:
            if self._writer is not None:
                self._writer.close()
            if isinstance(error, OSError):
                raise LogError(
                    f"{self.path}: cannot write the log: {error.strerror}"
                ) from error
            raise

    def _open(self, trace: Trace, world: BaseWorld) -> None:
        """Write header, metadata and attachments, and register the channels."""
        self.path.parent.mkdir(parents=True, exist_ok=True)
        versions = provenance.log_versions()
        self._writer = LogWriter(self.path, f"beacon-mj {versions['beacon-mj']}")
        attachments = {
            SCENE_NAME: trace.scene.to_json(),
            WORLD_NAME: world.mjcf.encode(),
        }
        digests = {
            n: hashlib.sha256(data).hexdigest() for n, data in attachments.items()
        }
        config = provenance.config(trace, self._planner_config, self._seed)
        self._writer.put(Metadata("config", config))
        self._writer.put(Metadata("versions", versions))
        self._writer.put(Metadata("machine", machine()))
        self._writer.put(Metadata("attachments", digests))
        for name, data in attachments.items():
            packed = gzip.compress(data, compresslevel=6, mtime=0)
            attachment = Attachment(0, 0, name + PACKED, "application/gzip", packed)
            self._writer.put(attachment)
        sheet = trace.protocol.sensor(trace.scene)
        turns = world.heading_rad is not None
        self._register(lidar=sheet.lidar_beams > 0, turns=turns)
        self._misled = sheet.robot_pose_noise_m > 0.0 or sheet.force_noise > 0.0

    def _register(self, *, lidar: bool, turns: bool) -> None:
        """Register every topic, and every schema once; some for some robots only."""
        left_out = {SCAN_TOPIC: not lidar, "/turn": not turns}
        topics = {t: s for t, s in TOPICS.items() if not left_out.get(t)}
        schemas = {name: k for k, name in enumerate(dict.fromkeys(topics.values()), 1)}
        for name, number in schemas.items():
            schema = Schema(number, schema_data(name), "protobuf", name)
            self._writer.define(schema)
        self._channels = {topic: k for k, topic in enumerate(topics, 1)}
        for topic, number in self._channels.items():
            channel = Channel(number, topic, "protobuf", {}, schemas[topics[topic]])
            self._writer.define(channel)

    def _reset(self, world: BaseWorld) -> None:
        """Forget what was written last."""
        self._time_ns = 0
        self._state = encoding.StateDelta()
        self._frames = Frames([o.id for o in world.scene.obstacles], world.poses)
        self._picture = BeliefPicture(world.scene)
        self._timeline = Timeline()
        self._plan = np.zeros((0, 2))
        self._decision: Any = None
        self._beliefs: dict[str, Any] = {}
        self._visible: list[str] = []
        self._mapped: dict[str, tuple[Footprint, bool]] = {}

    def _put(self, topic: str, message: Any) -> None:
        """Write a message at the present simulation time."""
        data = message.SerializeToString()
        self._writer.add(self._channels[topic], self._time_ns, data)

    def _log_decision(self, record: StepRecord) -> None:
        """Write what the planner decided, at the time when it decided."""
        command, info = record.command, record.command.info
        try:
            head, tail = self._log_path(info)
            self._put("/command", encoding.command_message(command, head, tail))
            if command.turn_rate_radps is not None:
                self._put("/turn", encoding.turn_message(command.turn_rate_radps))
            decision = encoding.decision_message(info)
            if decision != self._decision:
                self._decision = decision
                self._put("/decision", decision)
            if (state := self._timeline.decided(info, self._time_ns)) is not None:
                self._put("/timeline", state)
            if info.beliefs != self._beliefs:
                self._log_beliefs(info)
        except (TypeError, ValueError, AttributeError) as error:
            raise PlannerError(
                f"Expected a `PlannerInfo` that can be logged but: {error}."
            ) from error

    def _log_beliefs(self, info: PlannerInfo) -> None:
        """Write what the planner believes: whole, and as it is looked at."""
        self._beliefs = dict(info.beliefs)
        self._put("/belief", encoding.belief_message(info))
        self._put("/belief/rounded", rounded_belief(self._beliefs))
        picture = self._picture.update(self._beliefs, self._time_ns)
        self._put("/belief/picture", picture)

    def _log_path(self, info: PlannerInfo) -> tuple[Array, int]:
        """Write the plan if it is another one; return the path in terms of it."""
        path = np.zeros((0, 2))
        if info.path_m is not None:
            path = np.asarray(info.path_m, np.float64).reshape(-1, 2)
        split = encoding.split_path(path, self._plan)
        if split is None or (len(path) == 0) != (len(self._plan) == 0):
            self._plan = path.copy()
            self._put("/plan", encoding.plan_message(path, self._time_ns))
            if info.replanned and len(path):
                self._put("/log", events.replanned(info, self._time_ns))
            split = path[:0], len(path)
        return split

    def _log_poses(self, world: BaseWorld, before_ns: int) -> None:
        """Write where the robot is, and where what moves is."""
        position, now_ns = world.position_m, self._time_ns
        heading = world.heading_rad or 0.0
        self._put("/tf", robot_transform(position, now_ns, heading))
        moved = self._frames.moved(world.poses, before_ns, now_ns)
        if moved is not None:
            self._put("/tf/moved", moved)
        if now_ns % NS == 0:
            self._put("/robot", encoding.robot_message(position, now_ns, heading))

    def _log_state(self, world: BaseWorld, step: int) -> None:
        data = world.data
        self._put("/state", self._state.message(step, data.qpos, data.qvel))

    def _log_sensed(self, observation: Observation) -> None:
        """Write the sensor's map where it changed, and what is not as it is."""
        if self._misled:
            self._put("/told", encoding.told_message(observation))
        updated = []
        for o in observation.obstacles:
            known = self._mapped.get(o.id)
            if known is None or known[0] is not o.footprint or known[1] != o.broken:
                self._mapped[o.id] = (o.footprint, o.broken)
                updated.append(o)
        visible = [o.id for o in observation.obstacles if o.visible]
        if updated or visible != self._visible:
            self._visible = visible
            self._put("/sensed", encoding.sensed_message(visible, updated))

    def _log_scan(self, world: BaseWorld, observation: Observation) -> None:
        """Write what the lidar measured, as the planner gets it."""
        if observation.scan is not None:
            place, robot = world.position_m, world.scene.robot
            found = scan_message(observation.scan, place, robot, self._time_ns)
            self._put(SCAN_TOPIC, found)

    def _log_outcome(self, record: StepRecord, world: BaseWorld) -> None:
        """Write contacts, push attempts, damage, and what they mean in words."""
        outcome = record.outcome
        if outcome.contacts:
            self._put("/contacts", encoding.contacts_message(outcome.contacts))
            period_ns = round(world.scene.robot.control_period_s * NS)
            picture = drawing.arrows(outcome.contacts, self._time_ns, period_ns)
            if picture is not None:
                self._put("/contacts/arrows", picture)
        for attempt in outcome.attempts:
            self._put("/push", encoding.push_message(attempt))
            self._timeline.pushed(attempt, self._time_ns)
        for damage in outcome.damages:
            self._put("/damage", encoding.damage_message(damage))
        if outcome.damages:
            self._put("/scene", drawing.scene_update(world, self._time_ns))
        for event in events.of_step(record, self._time_ns):
            self._put("/log", event)

    def _log_last_states(self) -> None:
        """Write once more what still holds, so that its bar ends with the episode."""
        if self._decision is not None:
            self._put("/decision", self._decision)
            self._put("/timeline", self._timeline.state)
