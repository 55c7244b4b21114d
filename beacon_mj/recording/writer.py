"""An MCAP file that can be read while it grows, and is packed anew when it is whole.

Small chunks lose little when a run is killed, but pack badly and need much index. So
what `flush` writes is for the unfinished file alone; `finish` writes the same records
once more in chunks that grow with the file, each with the index by which viewers seek.
"""

import os
import struct
import zlib
from contextlib import suppress
from pathlib import Path

import zstandard
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    Header,
    McapRecord,
    MessageIndex,
    Metadata,
    Schema,
)

from beacon_mj.errors import LogError
from beacon_mj.files import replacing
from beacon_mj.recording.container import MAGIC
from beacon_mj.recording.finalize import WholeFile, record_bytes

#: A chunk is closed at this share of the bytes before it: what a cut may cost.
CHUNK_SHARE = 1 / 3
CHUNK_BYTES = 1 << 20  #: And at this size at the latest [bytes].
_FAST = zstandard.ZstdCompressionParameters.from_level(1)
#: As small as level 15 nearly, in half its time; chunks are some 100 kB.
_SMALL = zstandard.ZstdCompressionParameters.from_level(
    12,
    source_size=1 << 17,
    strategy=zstandard.STRATEGY_BTOPT,
    min_match=3,
    search_log=1,
)
_MESSAGE = struct.Struct("<BQHIQQ")


class _Chunk:
    """Records that are packed together, and where each message among them begins."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.messages: dict[int, list[tuple[int, int]]] = {}

    def add(self, channel_id: int, time_ns: int, data: bytes) -> None:
        """Append a message."""
        entry = time_ns, len(self.data)
        self.messages.setdefault(channel_id, []).append(entry)
        length = _MESSAGE.size - 9 + len(data)
        self.data += _MESSAGE.pack(
            Opcode.MESSAGE, length, channel_id, 0, time_ns, time_ns
        )
        self.data += data

    def extend(self, other: "_Chunk") -> None:
        """Append another chunk's records."""
        base = len(self.data)
        self.data += other.data
        for channel_id, entries in other.messages.items():
            mine = self.messages.setdefault(channel_id, [])
            mine += [(time_ns, base + offset) for time_ns, offset in entries]

    def packed(self, compressor: zstandard.ZstdCompressor) -> Chunk:
        """Return the chunk as a record."""
        times = [t for entries in self.messages.values() for t, _ in entries]
        return Chunk(
            compression="zstd",
            data=compressor.compress(self.data),
            message_start_time=min(times, default=0),
            message_end_time=max(times, default=0),
            uncompressed_crc=zlib.crc32(self.data),
            uncompressed_size=len(self.data),
        )


class LogWriter:
    """Writes one MCAP file, as `NAME.part` until it is finished."""

    def __init__(self, path: Path, library: str) -> None:
        """Open the unfinished file."""
        self._path = path
        self._part = path.with_name(f"{path.name}.part")
        self._file = self._part.open("wb")
        self._head: list[McapRecord] = []
        self._defined: list[Schema | Channel] = []
        self._pending, self._open = _Chunk(), _Chunk()
        self._closed: list[tuple[Chunk, list[MessageIndex]]] = []
        self._size = 0
        self._fast = zstandard.ZstdCompressor(compression_params=_FAST)
        self._small = zstandard.ZstdCompressor(compression_params=_SMALL)
        self._file.write(MAGIC)
        self.put(Header(profile="", library=library))

    def put(self, record: Header | Metadata | Attachment) -> None:
        """Write a record that stands before all chunks."""
        self._head.append(record)
        self._file.write(record_bytes(record))

    def define(self, record: Schema | Channel) -> None:
        """Write a schema, or a channel of one."""
        self._defined.append(record)
        self._pending.data += record_bytes(record)

    def add(self, channel_id: int, time_ns: int, data: bytes) -> None:
        """Write a message."""
        self._pending.add(channel_id, time_ns, data)

    def flush(self) -> None:
        """Make all that was written outlive this process."""
        pending, self._pending = self._pending, _Chunk()
        if pending.data:
            self._file.write(record_bytes(pending.packed(self._fast)))
            self._open.extend(pending)
        self._file.flush()
        size = len(self._open.data)
        if size >= min(CHUNK_BYTES, CHUNK_SHARE * self._size):
            self._close_chunk()

    def finish(self, last: Metadata) -> None:
        """Write the whole file, with a last record, and give it its name."""
        self.flush()
        self._close_chunk()
        whole = WholeFile()
        for record in self._head:
            whole.put(record)
        for chunk, index in self._closed:
            whole.put_chunk(chunk, index)
        whole.put(last)
        whole.end(self._defined)
        self.close()
        with replacing(self._part, LogError) as packed:
            packed.write_bytes(whole.data)
        os.replace(self._part, self._path)

    def close(self) -> None:
        """Close the unfinished file and leave it."""
        with suppress(OSError):  # A full disk: what is whole can be recovered.
            self._file.close()

    def _close_chunk(self) -> None:
        """Pack the open chunk, if there is anything in it."""
        done, self._open = self._open, _Chunk()
        if done.data:
            self._size += len(done.data)
            index = [MessageIndex(i, found) for i, found in done.messages.items()]
            self._closed.append((done.packed(self._small), index))
