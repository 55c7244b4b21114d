"""Logs that broke off, were damaged, or are hostile."""

import os
import signal
import struct
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import zstandard
from mcap.opcode import Opcode
from mcap.records import Chunk, McapRecord
from mcap.stream_reader import StreamReader

from beacon_mj.errors import LogError
from beacon_mj.recording import Recorder, read_log, read_trace, recover
from beacon_mj.recording.container import MAGIC, MAX_CHUNK_BYTES
from beacon_mj.recording.schemas import TOPICS
from tests.recording.conftest import Sample
from tests.recording.samples import difference, rewrite
from tests.repository import REPOSITORY


def _chunks(data: bytes) -> list[tuple[int, int]]:
    """Return begin and end of the packed data of every chunk in a log."""
    out, at = [], len(MAGIC)
    while at < len(data) - len(MAGIC):
        opcode, length = struct.unpack_from("<BQ", data, at)
        if opcode == Opcode.CHUNK:
            out.append((at + 9 + 40, at + 9 + length))
        at += 9 + length
    return out


def test_every_flipped_bit_in_message_data_is_caught(
    sample: Sample, tmp_path: Path
) -> None:
    data = sample.path.read_bytes()
    chunks = _chunks(data)
    assert len(chunks) > 5
    rng = np.random.default_rng(0)
    places = np.concatenate([np.arange(a, b) for a, b in chunks])
    path = tmp_path / "flipped.mcap"
    for place in rng.choice(places, 200, replace=False):
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        with pytest.raises(LogError, match=r"damaged|chunk"):
            read_log(path)


def test_flipped_bits_anywhere_are_caught(sample: Sample, tmp_path: Path) -> None:
    data = sample.path.read_bytes()
    rng = np.random.default_rng(1)
    path = tmp_path / "flipped.mcap"
    for place in rng.choice(len(data), 100, replace=False):
        damaged = bytearray(data)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            log = read_log(path)
        except LogError:
            continue
        assert not log.finished


@pytest.mark.parametrize("share", [0.6, 0.7, 0.8, 0.95, 0.999])
def test_truncated_log_is_read_to_its_last_whole_step(
    sample: Sample, tmp_path: Path, share: float
) -> None:
    data = sample.path.read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: int(share * len(data))])
    trace = read_trace(path)
    assert trace.outcome is None
    steps = len(trace.steps)
    assert 0 < steps <= len(sample.trace.steps)
    assert difference(sample.trace.steps[:steps], trace.steps) is None


@pytest.mark.parametrize("size", [9, 100, 1000, 10_000])
def test_log_that_broke_off_before_its_first_step_is_refused(
    sample: Sample, tmp_path: Path, size: int
) -> None:
    path = tmp_path / "cut.mcap"
    path.write_bytes(sample.path.read_bytes()[:size])
    with pytest.raises(LogError, match=r"cut.mcap: expected .*broke off"):
        read_log(path)


def test_finished_log_without_its_result_is_unfinished(
    sample: Sample, tmp_path: Path
) -> None:
    def change(topic: str, record: McapRecord) -> McapRecord | None:
        return None if getattr(record, "name", "") == "result" else record

    rewrite(sample.path, tmp_path / "x.mcap", change)
    assert not read_log(tmp_path / "x.mcap").finished


_CHILD = """
import sys, time
from pathlib import Path
from beacon_mj.episode.run import run_episode
from beacon_mj.recording import Recorder
from beacon_mj.scene_gen.generate import generate_scene
from tests.recording.samples import PushThrough

class Slow(Recorder):
    def step(self, record, world, observation):
        super().step(record, world, observation)
        print(record.outcome.step, flush=True)
        time.sleep(0.01)

run_episode(
    generate_scene("collision-shortcut", 0), PushThrough(),
    listeners=[Slow(Path(sys.argv[1]))],
)
"""


def test_sigkill_costs_at_most_the_last_simulated_second(
    sample: Sample, tmp_path: Path
) -> None:
    path = tmp_path / "x.mcap"
    child = subprocess.Popen(
        [sys.executable, "-c", _CHILD, str(path)],
        cwd=REPOSITORY,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert child.stdout is not None
    for line in child.stdout:
        if int(line) >= 47:
            break
    os.kill(child.pid, signal.SIGKILL)
    done = 47 + len(child.stdout.readlines())
    child.wait()
    child.stdout.close()
    assert not path.exists()
    part = path.with_name("x.mcap.part")
    trace = read_trace(part)
    assert trace.outcome is None
    assert done - 10 <= len(trace.steps) <= done + 1
    steps = len(trace.steps)
    assert difference(sample.trace.steps[:steps], trace.steps) is None

    assert recover(part, tmp_path / "clean.mcap") == steps
    assert difference(trace, read_trace(tmp_path / "clean.mcap")) is None
    with (tmp_path / "clean.mcap").open("rb") as file:
        assert sum(1 for _ in StreamReader(file).records) > steps
    with pytest.raises(LogError, match="cannot write"):
        recover(part, tmp_path / "clean.mcap")


def _with_chunk(sample: Sample, path: Path, chunk: Chunk) -> None:
    """Write the beginning of a log, then one chunk of our own, then the end."""
    data = sample.path.read_bytes()
    begin = _chunks(data)[0][0] - 49
    declared = struct.pack(
        "<QQQII4s",
        0,
        0,
        chunk.uncompressed_size,
        0,
        4,
        b"zstd",
    ) + struct.pack("<Q", len(chunk.data))
    body = declared + chunk.data
    record = struct.pack("<BQ", Opcode.CHUNK, len(body)) + body
    path.write_bytes(data[:begin] + record + MAGIC)


@pytest.mark.parametrize("declared", [1 << 31, MAX_CHUNK_BYTES, 1000])
def test_oversize_chunk_is_refused_without_its_memory(
    sample: Sample, tmp_path: Path, declared: int
) -> None:
    packed = zstandard.compress(bytes(1 << 29), 3)
    assert len(packed) < 100_000
    chunk = Chunk(
        compression="zstd",
        data=packed,
        message_start_time=0,
        message_end_time=0,
        uncompressed_crc=0,
        uncompressed_size=declared,
    )
    path = tmp_path / "bomb.mcap"
    _with_chunk(sample, path, chunk)
    began = time.perf_counter()
    tracemalloc.start()
    try:
        with pytest.raises(LogError, match=r"bomb.mcap: expected .*chunk"):
            read_log(path)
        assert tracemalloc.get_traced_memory()[1] < 100_000_000
    finally:
        tracemalloc.stop()
    assert time.perf_counter() - began < 10.0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "expected an MCAP file"),
        (b"PK\x03\x04 no log at all", "expected an MCAP file"),
        (MAGIC, "attachment 'scene.json'"),
        (MAGIC + MAGIC, "attachment 'scene.json'|damaged"),
    ],
)
def test_what_is_no_log_is_refused(
    tmp_path: Path, content: bytes, message: str
) -> None:
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(LogError, match=message) as caught:
        read_log(path)
    assert "\n" not in str(caught.value)


def test_missing_log_is_named(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"gone.mcap: cannot read the log: No such"):
        read_log(tmp_path / "gone.mcap")


def test_topic_with_another_schema_is_refused(sample: Sample, tmp_path: Path) -> None:
    def change(topic: str, record: McapRecord) -> McapRecord | None:
        if getattr(record, "name", "") == TOPICS["/step"]:
            record.name = "other.Step"  # type: ignore[attr-defined]
        return record

    rewrite(sample.path, tmp_path / "x.mcap", change)
    with pytest.raises(LogError, match=r"/step to carry beacon_mj.Step but .*other"):
        read_log(tmp_path / "x.mcap")


def test_unwritable_folder_gives_one_line(sample: Sample, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    recorder = Recorder(tmp_path / "file" / "x.mcap")
    with pytest.raises(LogError, match=r"x.mcap: cannot write the log"):
        recorder.begin(sample.trace, _world(sample), _observation(sample))


def _world(sample: Sample):  # type: ignore[no-untyped-def]
    from beacon_mj.world import World

    return World(sample.trace.scene)


def _observation(sample: Sample):  # type: ignore[no-untyped-def]
    from beacon_mj.episode.sensor import Sensor

    return Sensor(_world(sample), sample.trace.protocol).observe(None, 1.0)
