"""What a log makes its reader allocate is in proportion to the log."""

import os
import tracemalloc
from pathlib import Path

import msgspec
import numpy as np
import pytest
from mcap.records import McapRecord, Message, Metadata
from mcap.writer import Writer

from beacon_mj.episode.protocol import Protocol
from beacon_mj.errors import LogError
from beacon_mj.fidelity.benches import bench, block
from beacon_mj.recording import read_log, read_trace
from beacon_mj.recording.messages import message
from beacon_mj.recording.states import StateSequence, state_sizes
from beacon_mj.scene_gen.generate import generate_scene
from beacon_mj.scene_gen.robots import shipped_robot
from beacon_mj.world import World
from tests.recording.conftest import Sample
from tests.recording.samples import rewrite


def _peak(path: Path, message: str) -> int:
    """Return the most bytes that Python takes to refuse a log."""
    tracemalloc.start()
    try:
        with pytest.raises(LogError, match=message) as caught:
            read_trace(path)
        assert "\n" not in str(caught.value)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def _changed(
    sample: Sample, path: Path, topic: str, change: object, protocol: object = None
) -> Path:
    """Rewrite a log with its messages of one topic, and its protocol, changed."""

    def edit(where: str, record: McapRecord) -> McapRecord:
        if isinstance(record, Message) and where == topic:
            record.data = change(record.data)  # type: ignore[operator]
        if isinstance(record, Metadata) and record.name == "config" and protocol:
            record.metadata["protocol"] = msgspec.json.encode(protocol).decode()
        return record

    rewrite(sample.path, path, edit)
    return path


@pytest.mark.parametrize("name", ["sparse", "cluttered", "collision-required"])
def test_states_have_the_size_that_the_scene_gives(name: str) -> None:
    scene = generate_scene(name, 0)
    data = World(scene).data
    assert state_sizes(scene, shipped_robot("disc")) == (len(data.qpos), len(data.qvel))


def test_a_large_first_state_is_refused(sample: Sample, tmp_path: Path) -> None:
    """300,000 zeros pack to nothing, and each step used to have its own copy."""

    def swell(data: bytes) -> bytes:
        state = message("beacon_mj.State").FromString(data)
        if state.full:
            state.qpos.extend([0.0] * 300_000)
        return bytes(state.SerializeToString())

    path = _changed(sample, tmp_path / "x.mcap", "/state", swell)
    assert path.stat().st_size < 1_000_000
    peak = _peak(path, r"expected states of \d+ numbers, as its scene has them")
    assert peak < 60_000_000


def test_places_of_a_state_come_in_order(sample: Sample, tmp_path: Path) -> None:
    def repeat(data: bytes) -> bytes:
        state = message("beacon_mj.State").FromString(data)
        if not state.full:
            state.qpos_index.append(0)
            state.qpos.append(1.0)
        return bytes(state.SerializeToString())

    path = _changed(sample, tmp_path / "x.mcap", "/state", repeat)
    with pytest.raises(LogError, match="to change numbers it has, in order"):
        read_log(path)


def test_more_steps_than_the_protocol_has_are_refused(
    sample: Sample, tmp_path: Path
) -> None:
    few = Protocol(max_steps=5)
    path = _changed(sample, tmp_path / "x.mcap", "", None, few)
    with pytest.raises(LogError, match="expected at most 5 steps, as its protocol"):
        read_log(path)


def test_steps_at_one_time_are_refused(sample: Sample, tmp_path: Path) -> None:
    """Contacts belong to their time: many steps at one time would share them all."""

    def stop(topic: str, record: McapRecord) -> McapRecord:
        if isinstance(record, Message):
            record.log_time = min(record.log_time, 1_000_000_000)
        return record

    rewrite(sample.path, tmp_path / "x.mcap", stop)
    with pytest.raises(LogError, match="each step to be later than the last"):
        read_log(tmp_path / "x.mcap")


def test_messages_that_unpack_to_much_more_than_the_file_are_refused(
    sample: Sample, tmp_path: Path
) -> None:
    many = tmp_path / "many.mcap"

    def more(topic: str, record: McapRecord) -> McapRecord:
        if isinstance(record, Message):
            record.data = bytes(record.data) + _padding(200_000)
        return record

    rewrite(sample.path, many, more)
    assert many.stat().st_size < 3 * sample.path.stat().st_size
    assert _peak(many, "expected messages of at most") < 100_000_000


def _padding(size: int) -> bytes:
    """Return an unknown field of a message, of so many zeros."""
    length, out = size, b"\xfa\x7f"
    while length > 127:
        out, length = out + bytes([length & 127 | 128]), length >> 7
    return out + bytes([length]) + bytes(size)


def test_attachments_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "x.mcap"
    with path.open("wb") as out:
        writer = Writer(out)
        writer.start()
        for k in range(20):
            writer.add_attachment(0, 0, f"{k}", "text/plain", b"x")
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(LogError, match="at most 8 attachments"):
        read_log(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_only_regular_files_are_logs(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "x.mcap")
    for path in (tmp_path / "x.mcap", Path("/dev/zero")):
        with pytest.raises(LogError, match="expected a regular file"):
            read_log(path)


def test_deep_metadata_is_one_line(sample: Sample, tmp_path: Path) -> None:
    def change(topic: str, record: McapRecord) -> McapRecord:
        if isinstance(record, Metadata) and record.name == "config":
            record.metadata["protocol"] = '{"max_steps":' + "[" * 100_000
        return record

    rewrite(sample.path, tmp_path / "x.mcap", change)
    with pytest.raises(LogError, match="the stored protocol is not valid"):
        read_log(tmp_path / "x.mcap")


def test_states_are_found_in_any_order() -> None:
    rng = np.random.default_rng(0)
    states = [rng.normal(size=9)]
    sequence = StateSequence(states[0], 9, Path("x"))
    for _ in range(700):
        where = np.flatnonzero(rng.random(9) < 0.3)
        after = states[-1].copy()
        after[where] = rng.normal(size=len(where))
        sequence.append(where, after[where])
        states.append(after)
    np.testing.assert_array_equal(sequence.array(), states)
    for k in [*range(701), *rng.integers(0, 701, 300).tolist(), -1, 0, 700]:
        np.testing.assert_array_equal(sequence[k], states[k])
    with pytest.raises(IndexError):
        sequence[701]
    assert state_sizes(bench(block()), shipped_robot("disc")) == (11, 10)
