"""Episodes and logs that the recording tests share."""

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema
from mcap.writer import Writer

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.episode.trace import Trace
from beacon_mj.interface import Command, Observation, PlannerInfo, Task
from beacon_mj.planners.base import Planner
from beacon_mj.recording import Recorder
from beacon_mj.recording.container import Container
from beacon_mj.scene import Scene
from beacon_mj.scene_gen.generate import generate_scene


class PushThrough(Planner):
    """Drives straight at the goal, and fills every field of its `PlannerInfo`."""

    Config = type(None)

    def reset(self, task: Task) -> None:
        self.task = task
        self.known = 0

    def act(self, observation: Observation) -> Command:
        offset = self.task.goal_m - observation.position_m
        known, self.known = self.known, len(observation.obstacles)
        replanned = observation.step == 0 or known != self.known
        if replanned:
            self.path = np.linspace(observation.position_m, self.task.goal_m, 7)
        info = PlannerInfo(
            action="push" if observation.contacts else "move",
            reason="straight through",
            target=observation.contacts[0].id if observation.contacts else None,
            cost_push=1.5 if observation.contacts else None,
            cost_detour=float("inf") if observation.contacts else None,
            terms={"length": float(np.hypot(*offset)), "risk": 0.25},
            path_m=None if observation.step % 20 == 19 else self.path,
            beliefs={o.id: _normalised(o.scores) for o in observation.obstacles},
            replanned=replanned,
            expansions=7 if replanned else 0,
        )
        speed = self.task.speed_mps / np.hypot(*offset)
        return Command(velocity_mps=offset * speed, info=info)


class GiveUp(PushThrough):
    """Gives up after five steps."""

    def act(self, observation: Observation) -> Command:
        command = super().act(observation)
        if observation.step < 5:
            return command
        return dataclasses.replace(
            command, give_up=True, info=PlannerInfo(reason="no way")
        )


class Crash(PushThrough):
    """Raises after five steps."""

    def act(self, observation: Observation) -> Command:
        if observation.step == 5:
            raise ZeroDivisionError("oops")
        return super().act(observation)


def _normalised(scores: tuple[float, ...]) -> tuple[float, float, float]:
    a, b, c = (float(s) / sum(scores) for s in scores)
    return a, b, c


def scene_with_damage() -> Scene:
    """Return a scene in which PushThrough breaks one thing and moves two in a chain."""
    for index in range(30):
        scene = generate_scene("cluttered", index)
        outcomes = [s.outcome for s in run_episode(scene, PushThrough()).steps]
        chains = (len(d.chain) > 1 for o in outcomes for d in o.displacements)
        if any(o.damages for o in outcomes) and any(chains):
            return scene
    raise AssertionError("expected a scene with damage among thirty")


def row(trace: Trace) -> Mapping[str, Any]:
    """Return a small row, one column of it wall-clock."""
    forces = [c.peak_n for s in trace.steps for c in s.outcome.contacts]
    return {
        "outcome": trace.outcome,
        "steps": len(trace.steps),
        "battery": trace.steps[-1].battery if trace.steps else 1.0,
        "peak_force_n": max(forces, default=None),
        "wall_time_s": trace.wall_time_s,
    }


def record(
    path: Path,
    scene: Scene | None = None,
    planner: Planner | None = None,
    protocol: Protocol | None = None,
) -> Trace:
    """Run and log an episode; return the live trace."""
    recorder = Recorder(path, planner_config={"gain": 0.1}, seed=3, row=row)
    return run_episode(
        generate_scene("collision-shortcut", 0) if scene is None else scene,
        PushThrough() if planner is None else planner,
        name="push-through",
        protocol=protocol,
        seed=3,
        listeners=[recorder],
    )


def rewrite(
    path: Path, out: Path, change: Callable[[str, McapRecord], McapRecord | None]
) -> None:
    """Copy a log record by record, as a forger who mends every checksum would.

    `change` gets the topic, or an empty string, and the record; None drops it.
    """
    topics: dict[int, str] = {}
    with out.open("wb") as file:
        writer: Any = Writer(file, enable_data_crcs=True)
        writer.start()
        seen: set[tuple[str, int]] = set()
        for record in Container(path).records():
            if isinstance(record, Schema | Channel):
                key = type(record).__name__, record.id
                if key in seen:
                    continue
                seen.add(key)
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            topic = topics[record.channel_id] if isinstance(record, Message) else ""
            changed = change(topic, record)
            if changed is not None:
                _write(writer, changed)
        writer.finish()


def _write(writer: Any, r: McapRecord) -> None:
    """Write a record; identifiers stay, as they are numbered in order."""
    match r:
        case Schema():
            writer.register_schema(r.name, r.encoding, r.data)
        case Channel():
            writer.register_channel(r.topic, r.message_encoding, r.schema_id)
        case Message():
            writer.add_message(
                r.channel_id, r.log_time, r.data, r.publish_time, r.sequence
            )
        case Attachment():
            writer.add_attachment(0, 0, r.name, r.media_type, r.data)
        case Metadata():
            writer.add_metadata(r.name, r.metadata)


def difference(a: Any, b: Any, path: str = "trace") -> str | None:
    """Return where two traces first differ, in value, type or bits."""
    if type(a) is not type(b):
        return f"{path}: {type(a)} and {type(b)}"
    if isinstance(a, np.ndarray):
        same = a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
        return None if same else f"{path}: {a} and {b}"
    if dataclasses.is_dataclass(a):
        names = [f.name for f in dataclasses.fields(a)]
        pairs = [(n, getattr(a, n), getattr(b, n)) for n in names if n not in _CLOCKS]
    elif isinstance(a, tuple | list) and len(a) == len(b):
        pairs = [(str(k), x, y) for k, (x, y) in enumerate(zip(a, b, strict=True))]
    else:
        return None if a == b else f"{path}: {a!r} and {b!r}"
    found = (difference(x, y, f"{path}.{name}") for name, x, y in pairs)
    return next((f for f in found if f is not None), None)


_CLOCKS = {"decision_s", "wall_time_s"}
