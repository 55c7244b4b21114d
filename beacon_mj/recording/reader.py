"""The only way into a log, finished or not."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
from google.protobuf.message import DecodeError
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema

from beacon_mj.constants import LOG_SCHEMA
from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import LogError, SceneError, TemplateError
from beacon_mj.geometry import Array
from beacon_mj.recording.container import Container
from beacon_mj.recording.drawing import NS
from beacon_mj.recording.messages import message
from beacon_mj.recording.schemas import SCENE_NAME, TOPICS, WORLD_NAME
from beacon_mj.recording.states import StateSequence, state_sizes
from beacon_mj.scene import Scene
from beacon_mj.scene.files import parse_scene
from beacon_mj.scene_gen.mjcf import scene_mjcf
from beacon_mj.scene_gen.robots import robot_in
from beacon_mj.world.overnight import Left


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Log:
    """One episode's log.

    Attributes:
        path: Where it was read.
        finished: Whether the episode ended and the file is whole.
        scene: The attached scene.
        mjcf: The attached MJCF world; never compile it, see `regenerated`.
        config: Planner, its configuration, protocol and seeds, as text.
        versions: Versions of the engine and of what else the numbers depend on.
        machine: What machine recorded it; empty where the log does not say.
        result: Outcome, detail, steps and row, as text; empty if unfinished.
        protocol: How the episode was run.
        left: How the room was left the day before; None where it is as in the scene.
        messages: Decoded messages of each topic with their times [ns], in order.
        positions: Generalised positions at the start and after each step: `[k]` is
            (nq,).
        rates: Generalised velocities: `[k]` is (nv,).
    """

    path: Path
    finished: bool
    scene: Scene
    mjcf: str
    config: dict[str, str]
    versions: dict[str, str]
    machine: dict[str, str]
    result: dict[str, str]
    protocol: Protocol
    left: Left | None
    messages: dict[str, list[tuple[int, Any]]]
    positions: StateSequence
    rates: StateSequence

    @property
    def steps(self) -> int:
        """Number of whole control steps in the log."""
        return len(self.positions) - 1

    @property
    def qpos(self) -> Array:
        """All generalised positions, put together anew, (steps + 1, nq)."""
        return self.positions.array()

    @property
    def qvel(self) -> Array:
        """All generalised velocities, put together anew, (steps + 1, nv)."""
        return self.rates.array()

    def regenerated(self) -> str:
        """Return the MJCF world that the scene gives: the one that may be compiled."""
        return scene_mjcf(self.scene, self.protocol.timestep_s, self.protocol.robot)

    @property
    def planner(self) -> str:
        """Name of the planner."""
        return self.config.get("planner", "unknown")

    @property
    def row(self) -> dict[str, Any] | None:
        """The stored row of the episode, or None."""
        text = self.result.get("row")
        try:
            return None if text is None else dict(msgspec.json.decode(text))
        except (msgspec.DecodeError, TypeError, ValueError, RecursionError) as error:
            raise LogError(f"{self.path}: the stored row is no JSON object.") from error

    def at(self, topic: str) -> Iterator[tuple[float, Any]]:
        """Yield (time [s], message) of one topic."""
        for time_ns, found in self.messages[topic]:
            yield time_ns / NS, found


@dataclass(slots=True)
class _Raw:
    """What a pass over the records collects."""

    attachments: dict[str, bytes] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    topics: dict[int, str] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    messages: list[Message] = field(default_factory=list)


def log_of(source: "Log | str | Path") -> Log:
    """Return a log as it is, or read it. Raises LogError if it cannot be read."""
    return source if isinstance(source, Log) else read_log(source)


def read_log(path: str | Path) -> Log:
    """Read and check a log.

    A log that broke off, such as a `.part` file, is read up to its last whole step.

    Raises:
        LogError: If the file is missing, damaged, too large, or not a log of this
            project; the message names the file, what was expected and what was found.
    """
    path = Path(path)
    container = Container(path)
    raw = _Raw()
    for record in container.records():
        _collect(raw, record, path)
    _check_attachments(raw, path)
    _check_schema(raw, path)
    scene, protocol = _scene(raw, path), _protocol(raw, path)
    finished = container.whole and "result" in raw.metadata
    messages = _whole_steps(_decoded(raw, path), finished)
    _check_steps(messages, protocol.step_limit(scene), path)
    _check_scans(messages, protocol.sensor(scene).lidar_beams, path)
    positions, rates = _states(messages, _sizes(scene, protocol, path), path)
    return Log(
        path=path,
        finished=finished,
        scene=scene,
        mjcf=raw.attachments[WORLD_NAME].decode(errors="replace"),
        config=raw.metadata.get("config", {}),
        versions=raw.metadata.get("versions", {}),
        machine=raw.metadata.get("machine", {}),
        result=raw.metadata.get("result", {}),
        protocol=protocol,
        left=_left(raw, path),
        messages=messages,
        positions=positions,
        rates=rates,
    )


def _collect(raw: _Raw, record: McapRecord, path: Path) -> None:
    match record:
        case Attachment():
            raw.attachments[record.name] = record.data
        case Metadata():
            raw.metadata[record.name] = record.metadata
        case Schema():
            raw.schemas[record.id] = record
        case Channel():
            raw.topics[record.id] = record.topic
            _check_channel(raw, record, path)
        case Message():
            raw.messages.append(record)


def _check_channel(raw: _Raw, channel: Channel, path: Path) -> None:
    """Check that a known topic carries the message it should."""
    expected = TOPICS.get(channel.topic)
    schema = raw.schemas.get(channel.schema_id)
    found = "no schema" if schema is None else schema.name
    if expected is not None and found != expected:
        raise LogError(
            f"{path}: expected {channel.topic} to carry {expected} but it carries "
            f"{found}."
        )


def _check_attachments(raw: _Raw, path: Path) -> None:
    """Check that the attachments are there and are those that were written."""
    digests = raw.metadata.get("attachments", {})
    for name in (SCENE_NAME, WORLD_NAME):
        if name not in raw.attachments or name not in digests:
            raise LogError(
                f"{path}: expected attachment {name!r} and its SHA-256 but they are "
                "missing: not a log of beacon-mj, or it broke off at its beginning."
            )
        found = hashlib.sha256(raw.attachments[name]).hexdigest()
        if found != digests[name]:
            raise LogError(
                f"{path}: expected attachment {name!r} to have SHA-256 "
                f"{digests[name][:16]}... but it has {found[:16]}..."
            )


def _check_schema(raw: _Raw, path: Path) -> None:
    """Refuse a log whose topics or columns had other names."""
    found = raw.metadata.get("config", {}).get("schema", "1")
    if found != str(LOG_SCHEMA):
        writer = raw.metadata.get("versions", {}).get("beacon-mj", "an unknown version")
        raise LogError(
            f"{path}: expected a log of schema {LOG_SCHEMA} but it is of schema "
            f"{found}: read it with the beacon-mj that wrote it, {writer}."
        )


def _scene(raw: _Raw, path: Path) -> Scene:
    try:
        return parse_scene(raw.attachments[SCENE_NAME], f"{path}: {SCENE_NAME}")
    except SceneError as error:
        raise LogError(str(error)) from error


def _protocol(raw: _Raw, path: Path) -> Protocol:
    text = raw.metadata.get("config", {}).get("protocol", "")
    try:
        return msgspec.json.decode(text, type=Protocol)
    except (msgspec.DecodeError, UnicodeEncodeError, RecursionError) as error:
        raise LogError(f"{path}: the stored protocol is not valid: {error}.") from error


def _left(raw: _Raw, path: Path) -> Left | None:
    text = raw.metadata.get("config", {}).get("left")
    try:
        return None if text is None else msgspec.json.decode(text, type=Left)
    except (msgspec.DecodeError, UnicodeEncodeError, RecursionError) as error:
        raise LogError(
            f"{path}: how the room was left is not valid: {error}."
        ) from error


def _decoded(raw: _Raw, path: Path) -> list[tuple[str, int, Any]]:
    """Return (topic, time [ns], message) of every known topic, in file order."""
    classes = {topic: message(name) for topic, name in TOPICS.items()}
    out = []
    for record in raw.messages:
        topic = raw.topics.get(record.channel_id, "")
        if topic not in classes:
            continue
        try:
            found = classes[topic].FromString(record.data)
        except (DecodeError, RecursionError) as error:
            raise LogError(
                f"{path}: a message on {topic} is no {TOPICS[topic]}: {error}."
            ) from error
        out.append((topic, record.log_time, found))
    return out


def _whole_steps(
    decoded: list[tuple[str, int, Any]], finished: bool
) -> dict[str, list[tuple[int, Any]]]:
    """Sort messages by topic, without those of a step that broke off.

    `/step` is the last message of its step. What follows the last one is of the end of
    a finished log, or in words.
    """
    last = max((k for k, m in enumerate(decoded) if m[0] == "/step"), default=-1)
    out: dict[str, list[tuple[int, Any]]] = {topic: [] for topic in TOPICS}
    for k, (topic, time_ns, found) in enumerate(decoded):
        if k <= last or finished or topic == "/log":
            out[topic].append((time_ns, found))
    return out


def _check_steps(
    messages: dict[str, list[tuple[int, Any]]], limit: int, path: Path
) -> None:
    """Check that there are no more steps than may be, each later than the last."""
    times = [time_ns for time_ns, _ in messages["/step"]]
    if len(times) > limit + 1:
        raise LogError(
            f"{path}: expected at most {limit} steps, as its protocol says, but there "
            f"are {len(times) - 1}."
        )
    if any(after <= before for before, after in pairwise(times)):
        raise LogError(f"{path}: expected each step to be later than the last.")


def _check_scans(
    messages: dict[str, list[tuple[int, Any]]], beams: int, path: Path
) -> None:
    """Check that a lidar scanned at the start and once a step, with all its beams."""
    scans = [scan for _, scan in messages["/scan"]]
    expected = len(messages["/step"]) if beams else 0
    if len(scans) != expected or any(len(scan.ranges) != beams for scan in scans):
        raise LogError(
            f"{path}: expected {expected} scans of {beams} beams but there are "
            f"{len(scans)}, or some are of another size."
        )


def _sizes(scene: Scene, protocol: Protocol, path: Path) -> tuple[int, int]:
    try:
        return state_sizes(scene, robot_in(scene, protocol.robot))
    except TemplateError as error:
        raise LogError(f"{path}: {error}") from error


def _states(
    messages: dict[str, list[tuple[int, Any]]], sizes: tuple[int, int], path: Path
) -> tuple[StateSequence, StateSequence]:
    """Return every state's positions and velocities."""
    found = messages["/state"]
    if not found:
        raise LogError(
            f"{path}: expected a state at the start but there is none: the log broke "
            "off at its beginning."
        )
    if not found[0][1].full or len(found) != len(messages["/step"]):
        raise LogError(
            f"{path}: expected a full state at the start and one state per step but "
            f"there are {len(found)} states and {len(messages['/step'])} steps."
        )
    nq, nv = sizes
    positions = StateSequence(found[0][1].qpos, nq, path)
    rates = StateSequence(found[0][1].qvel, nv, path)
    for _, state in found[1:]:
        positions.append(state.qpos_index, state.qpos)
        rates.append(state.qvel_index, state.qvel)
    return positions, rates
