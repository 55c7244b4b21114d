"""A finished log is small, and other readers find in it all that is there."""

import gzip
import struct
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from mcap.opcode import Opcode
from mcap.reader import NonSeekingReader, SeekingReader
from mcap.records import Attachment, Chunk, McapRecord, Message, MessageIndex
from mcap.stream_reader import StreamReader, breakup_chunk

from beacon_mj.episode.protocol import Protocol
from beacon_mj.episode.run import run_episode
from beacon_mj.errors import LogError
from beacon_mj.planners.bug1 import Bug1
from beacon_mj.planners.registry import load_planner
from beacon_mj.recording import Recorder, read_log, read_trace
from beacon_mj.recording.container import MAGIC, MAX_CHUNK_BYTES
from beacon_mj.recording.finalize import record_bytes
from beacon_mj.recording.schemas import OPTIONAL_TOPICS, SCENE_NAME, TOPICS, WORLD_NAME
from beacon_mj.scene_gen.generate import generate_scene
from tests.recording.conftest import Sample
from tests.recording.samples import difference, rewrite

MOST_BYTES = 300_000  #: Of the longest episode that the protocol allows.


def test_longest_episode_stays_small(tmp_path: Path) -> None:
    """Bug1 goes round the same things until its time is up."""
    path = tmp_path / "x.mcap"
    scene = generate_scene("collision-shortcut", 16)
    live = run_episode(scene, Bug1(), name="bug1", listeners=[Recorder(path)])
    assert len(live.steps) == Protocol().step_limit(live.scene)
    assert path.stat().st_size <= MOST_BYTES
    assert difference(live, read_trace(path)) is None
    assert [p.name for p in tmp_path.iterdir()] == ["x.mcap"]


@pytest.mark.parametrize(
    ("planner", "family"),
    [
        ("dstar-lite", "sparse"),
        ("push-through", "cluttered"),
        ("beacon", "collision-required"),
        ("beacon-voi", "collision-shortcut"),
    ],
)
def test_logs_of_the_planners_of_the_table_are_small(
    planner: str, family: str, tmp_path: Path
) -> None:
    path = tmp_path / "x.mcap"
    scene, made = generate_scene(family, 0), load_planner(planner)[1]()
    live = run_episode(scene, made, name=planner, listeners=[Recorder(path)])
    assert len(live.steps) > 50
    assert 30_000 < path.stat().st_size <= MOST_BYTES


def test_chunks_grow_with_the_file(sample: Sample) -> None:
    with sample.path.open("rb") as file:
        summary = SeekingReader(file).get_summary()
    assert summary is not None
    sizes = [chunk.uncompressed_size for chunk in summary.chunk_indexes]
    second = max(sizes[1:3])
    for k in range(1, len(sizes)):
        assert sizes[k] <= sum(sizes[:k]) / 3 + second


def test_every_message_is_indexed_where_it_stands(damage: Sample) -> None:
    """Foxglove sees only what the index of messages names."""
    with damage.path.open("rb") as file:
        records = list(StreamReader(file, emit_chunks=True).records)
    chunk = None
    entries, expected = set[tuple[int, int, int]](), set[tuple[int, int, int]]()
    for record in [*records, None]:
        if isinstance(record, MessageIndex):
            entries |= {(record.channel_id, *entry) for entry in record.records}
            continue
        assert entries == expected
        if isinstance(record, Chunk):
            chunk, entries, expected = record, set(), _places(record)
            assert expected
    assert chunk is not None


def _places(chunk: Chunk) -> set[tuple[int, int, int]]:
    """Return (channel, time [ns], offset in the unpacked data) of all messages."""
    out, offset = set(), 0
    for record in breakup_chunk(chunk, validate_crc=True):
        if isinstance(record, Message):
            out.add((record.channel_id, record.log_time, offset))
        offset += len(record_bytes(record))
    return out


def test_summary_is_grouped_and_counts_everything(damage: Sample) -> None:
    data = damage.path.read_bytes()
    start = struct.unpack_from("<Q", data, len(data) - len(MAGIC) - 20)[0]
    kinds, at = [], start
    while at < len(data) - len(MAGIC):
        opcode, length = struct.unpack_from("<BQ", data, at)
        kinds.append(Opcode(opcode))
        at += 9 + length
    changes = 1 + sum(a != b for a, b in pairwise(kinds))
    assert changes == len(set(kinds)) == 7
    with damage.path.open("rb") as file:
        summary = SeekingReader(file).get_summary()
    assert summary is not None
    counts = summary.statistics.channel_message_counts  # type: ignore[union-attr]
    log = read_log(damage.path)
    found = {c.topic: counts.get(c.id, 0) for c in summary.channels.values()}
    assert found == {
        topic: len(log.messages[topic]) for topic in TOPICS.keys() - OPTIONAL_TOPICS
    }


def test_seeking_and_streaming_readers_agree(damage: Sample) -> None:
    def read(kind: Any, **options: Any) -> list[tuple[str, int, bytes]]:
        with damage.path.open("rb") as file:
            found = kind(file).iter_messages(**options)
            return [(c.topic, m.log_time, m.data) for _, c, m in found]

    assert len(read(SeekingReader)) > 500
    assert read(SeekingReader) == read(NonSeekingReader)
    late = {"topics": ["/state"], "starting_at": 5_000_000_000}
    assert len(read(SeekingReader, **late)) == len(damage.trace.steps) - 49


def test_attachments_unpack_with_gzip(sample: Sample) -> None:
    with sample.path.open("rb") as file:
        attachments = {a.name: a.data for a in SeekingReader(file).iter_attachments()}
    log = read_log(sample.path)
    assert attachments.keys() == {f"{SCENE_NAME}.gz", f"{WORLD_NAME}.gz"}
    scene = gzip.decompress(attachments[f"{SCENE_NAME}.gz"])
    assert scene == log.scene.to_json()
    assert gzip.decompress(attachments[f"{WORLD_NAME}.gz"]).decode() == log.mjcf


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (gzip.compress(bytes(MAX_CHUNK_BYTES + 1)), "to be whole and at"),
        (b"no gzip", "damaged"),
        (gzip.compress(b""), "empty"),
    ],
    ids=["too large", "no gzip", "empty"],
)
def test_hostile_attachment_is_refused(
    sample: Sample, tmp_path: Path, data: bytes, message: str
) -> None:
    def change(topic: str, r: McapRecord) -> McapRecord:
        if isinstance(r, Attachment) and r.name == WORLD_NAME:
            r.name, r.data = f"{WORLD_NAME}.gz", data
        return r

    rewrite(sample.path, tmp_path / "x.mcap", change)
    with pytest.raises(LogError, match=message):
        read_log(tmp_path / "x.mcap")
