"""Logs with good checksums and anything in them: refused, or what verify says."""

import functools
import json
import tempfile
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import numpy as np
import pytest
from mcap.records import Attachment, McapRecord, Message, Metadata

from beacon_mj import measure_log
from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.errors import LogError
from beacon_mj.eval.metrics.measure import measure
from beacon_mj.recording import Recorder, read_log, read_trace, verify
from beacon_mj.recording.messages import message
from beacon_mj.recording.schemas import SCENE_NAME, TOPICS
from beacon_mj.scene_gen.generate import generate_scene
from tests.fuzz.harness import Kind, attempt
from tests.fuzz.mutations import WILD, damaged, mutated, text_of
from tests.recording.samples import PushThrough, rewrite

NUMBERS = (0, 1, -1, 2**31, 2**32 - 1, 0.5, 1e300, -1e300, np.nan, np.inf, -np.inf)


@functools.cache
def base() -> bytes:
    """Return a log of a few steps, its row with it."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.mcap"
        run_episode(
            generate_scene("sparse", 0),
            PushThrough(),
            protocol=Protocol(max_steps=6, decision_limit_s=3600.0),
            listeners=[Recorder(path, row=lambda t: measure(t).as_dict())],
        )
        return path.read_bytes()


class Input(NamedTuple):
    """Which records are changed, and by which seed."""

    share: float
    seed: int


def make(rng: Random) -> Input:
    return Input(rng.choice([0.0, 0.005, 0.05, 0.3]), rng.randrange(2**32))


def forge(given: Input, source: Path, out: Path) -> None:
    """Write a log some records of which are changed, all checksums mended."""
    rng = Random(given.seed)
    scene = _scene(rng)

    def change(topic: str, record: McapRecord) -> McapRecord | None:
        if isinstance(record, Attachment) and record.name.startswith(SCENE_NAME):
            record.name, record.data = SCENE_NAME, scene or record.data
        if isinstance(record, Metadata) and record.name == "attachments" and scene:
            record.metadata[SCENE_NAME] = sha256(scene).hexdigest()
        if rng.random() > given.share:
            return record
        if isinstance(record, Metadata) and record.name != "attachments":
            _change_metadata(record, rng)
        elif isinstance(record, Message) and topic in TOPICS:
            return _changed(topic, record, rng)
        return record

    rewrite(source, out, change)


def _scene(rng: Random) -> bytes | None:
    if rng.random() < 0.8:
        return None
    return text_of(mutated(json.loads(generate_scene("sparse", 0).to_json()), rng))


def _change_metadata(record: Metadata, rng: Random) -> None:
    key = rng.choice([*record.metadata, "new"])
    value = record.metadata.get(key, "")
    try:
        text = text_of(mutated(json.loads(value), rng)).decode()
    except (ValueError, IndexError, TypeError):
        text = str(rng.choice(WILD)).encode(errors="replace").decode()
    record.metadata[key] = rng.choice([text, "[" * 5000, "9" * 5000, ""])


def _changed(topic: str, record: Message, rng: Random) -> Message | None:
    match rng.randrange(5):
        case 0:
            return None
        case 1:
            record.data = damaged(record.data, rng)[:100_000]
        case 2:
            record.log_time = max(
                0, record.log_time + rng.choice([-1, 1, 10**9, 2**62])
            )
        case _:
            found = message(TOPICS[topic]).FromString(record.data)
            _change_field(found, rng)
            record.data = found.SerializeToString()
    return record


def _change_field(found: Any, rng: Random) -> None:
    """Change a field of a message, or of one that it holds."""
    fields = [f for f, _ in found.ListFields()] or list(found.DESCRIPTOR.fields)
    field = rng.choice(fields)
    value = getattr(found, field.name)
    try:
        if field.message_type is not None and not hasattr(value, "add"):
            _change_field(value, rng)
        elif hasattr(value, "add") and len(value):
            _change_field(rng.choice(list(value)), rng)
        elif hasattr(value, "append"):
            value.extend([*list(value)[:50], rng.choice(NUMBERS)])
        else:
            setattr(found, field.name, rng.choice([*NUMBERS, "nobody", "\x1b[2J", ""]))
    except (TypeError, ValueError):
        found.ClearField(field.name)


def check(given: Input, folder: Path) -> bool:
    """Read, measure and verify; none of them may fail without a reason."""
    source, out = folder / "base.mcap", folder / "forged.mcap"
    source.write_bytes(base())
    forge(given, source, out)
    log = attempt(lambda: read_log(out))
    attempt(lambda: read_trace(out))
    attempt(lambda: str(measure_log(out)))
    found = verify(out, row=lambda trace: measure(trace).as_dict())
    assert found.ok or found.problem
    assert log is not None or not found.ok
    return not found.ok


LOGS = Kind("logs", make, check)
test_logs, test_logs_long = LOGS.short(), LOGS.long()


def test_the_log_that_is_changed_is_sound(tmp_path: Path) -> None:
    assert not check(Input(0.0, 1), tmp_path)


def _with(tmp_path: Path, change: Callable[[str, McapRecord], None]) -> Path:
    def edit(topic: str, record: McapRecord) -> McapRecord:
        change(topic, record)
        return record

    (tmp_path / "base.mcap").write_bytes(base())
    rewrite(tmp_path / "base.mcap", tmp_path / "x.mcap", edit)
    return tmp_path / "x.mcap"


def test_a_seed_of_thousands_of_digits_is_one_line(tmp_path: Path) -> None:
    def change(topic: str, record: McapRecord) -> None:
        if isinstance(record, Metadata) and record.name == "config":
            record.metadata["planner_seed"] = "9" * 5000

    found = verify(_with(tmp_path, change))
    assert found.problem
    assert "expected a planner's seed" in found.problem


@pytest.mark.parametrize("value", ["nobody", np.inf])
def test_numbers_of_no_episode_are_not_measured(value: Any, tmp_path: Path) -> None:
    def change(topic: str, record: McapRecord) -> None:
        if not isinstance(record, Message) or topic not in ("/belief", "/step"):
            return
        found = message(TOPICS[topic]).FromString(record.data)
        if topic == "/step" and value != "nobody":
            found.actuator_work_j = rng.choice([value, -value])
        for each in found.obstacles if topic == "/belief" else ():
            each.obstacle = str(value)
        record.data = found.SerializeToString()

    rng = Random(0)
    with pytest.raises(LogError, match=r"names or needs what|cannot be measured"):
        measure_log(_with(tmp_path, change))
