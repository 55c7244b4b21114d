"""An MCAP file that can be read while it grows, and is packed anew when it is whole.

Small chunks lose little when a run is killed, but pack badly and need much index. So
what `flush` writes is for the unfinished file alone; `finish` writes the same records
once more in chunks that grow with the file, each with the index by which viewers seek.
"""

import os
import struct
import zlib
from itertools import pairwise
from pathlib import Path

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from beacon_mj.recording.container import MAGIC

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
_FOOTER_START = struct.Struct("<BQQQ")


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

    def packed(self, how: zstandard.ZstdCompressionParameters) -> Chunk:
        """Return the chunk as a record."""
        compressor = zstandard.ZstdCompressor(compression_params=how)
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
        self._file.write(MAGIC)
        self.put(Header(profile="", library=library))

    def put(self, record: Header | Metadata | Attachment) -> None:
        """Write a record that stands before all chunks."""
        self._head.append(record)
        self._file.write(_bytes(record))

    def define(self, record: Schema | Channel) -> None:
        """Write a schema, or a channel of one."""
        self._defined.append(record)
        self._pending.data += _bytes(record)

    def add(self, channel_id: int, time_ns: int, data: bytes) -> None:
        """Write a message."""
        self._pending.add(channel_id, time_ns, data)

    def flush(self) -> None:
        """Make all that was written outlive this process."""
        pending, self._pending = self._pending, _Chunk()
        if pending.data:
            self._file.write(_bytes(pending.packed(_FAST)))
            self._open.extend(pending)
        self._file.flush()
        size = len(self._open.data)
        if size >= min(CHUNK_BYTES, CHUNK_SHARE * self._size):
            self._close_chunk()

    def finish(self, last: Metadata) -> None:
        """Write the whole file, with a last record, and give it its name."""
        self.flush()
        self._close_chunk()
        whole = _Whole()
        for record in self._head:
            whole.put(record)
        for chunk, index in self._closed:
            whole.put_chunk(chunk, index)
        whole.put(last)
        whole.end(self._defined)
        self.close()
        packed = self._path.with_name(f"{self._path.name}.packed")
        packed.write_bytes(whole.data)
        os.replace(packed, self._part)
        os.replace(self._part, self._path)

    def close(self) -> None:
        """Close the unfinished file and leave it."""
        self._file.close()

    def _close_chunk(self) -> None:
        """Pack the open chunk, if there is anything in it."""
        done, self._open = self._open, _Chunk()
        if done.data:
            self._size += len(done.data)
            index = [MessageIndex(i, found) for i, found in done.messages.items()]
            self._closed.append((done.packed(_SMALL), index))


class _Whole:
    """A finished file in memory."""

    def __init__(self) -> None:
        self.data = bytearray(MAGIC)
        self._indexes: list[ChunkIndex | AttachmentIndex | MetadataIndex] = []
        self._counts: dict[int, int] = {}

    def put(self, record: McapRecord) -> None:
        """Append a record, and remember where it is."""
        offset, data = len(self.data), _bytes(record)
        self.data += data
        match record:
            case Metadata():
                index = MetadataIndex(offset, len(data), record.name)
                self._indexes.append(index)
            case Attachment():
                self._indexes.append(
                    AttachmentIndex(
                        offset=offset,
                        length=len(data),
                        log_time=record.log_time,
                        create_time=record.create_time,
                        data_size=len(record.data),
                        name=record.name,
                        media_type=record.media_type,
                    )
                )

    def put_chunk(self, chunk: Chunk, messages: list[MessageIndex]) -> None:
        """Append a chunk with the index of its messages."""
        start = len(self.data)
        self.put(chunk)
        places = [len(self.data)]
        for index in messages:
            self.put(index)
            places.append(len(self.data))
            count = self._counts.get(index.channel_id, 0)
            self._counts[index.channel_id] = count + len(index.records)
        self._indexes.append(
            ChunkIndex(
                chunk_start_offset=start,
                chunk_length=places[0] - start,
                compression=chunk.compression,
                compressed_size=len(chunk.data),
                uncompressed_size=chunk.uncompressed_size,
                message_start_time=chunk.message_start_time,
                message_end_time=chunk.message_end_time,
                message_index_length=places[-1] - places[0],
                message_index_offsets={
                    index.channel_id: place
                    for index, (place, _) in zip(
                        messages, pairwise(places), strict=True
                    )
                },
            )
        )

    def end(self, defined: list[Schema | Channel]) -> None:
        """Append the summary, by which readers find everything."""
        self.put(DataEnd(zlib.crc32(self.data)))
        start = len(self.data)
        for record in (*defined, self._statistics(defined), *self._indexes):
            self.data += _bytes(record)
        footer = _FOOTER_START.pack(Opcode.FOOTER, 20, start, 0)
        crc = zlib.crc32(self.data[start:] + footer)
        self.put(Footer(summary_start=start, summary_offset_start=0, summary_crc=crc))
        self.data += MAGIC

    def _statistics(self, defined: list[Schema | Channel]) -> Statistics:
        chunks = [i for i in self._indexes if isinstance(i, ChunkIndex)]
        kinds = [type(record) for record in (*defined, *self._indexes)]
        return Statistics(
            attachment_count=kinds.count(AttachmentIndex),
            channel_count=kinds.count(Channel),
            channel_message_counts=self._counts,
            chunk_count=len(chunks),
            message_count=sum(self._counts.values()),
            message_end_time=max(c.message_end_time for c in chunks),
            message_start_time=min(c.message_start_time for c in chunks),
            metadata_count=kinds.count(MetadataIndex),
            schema_count=kinds.count(Schema),
        )


def _bytes(record: McapRecord) -> bytes:
    """Return a record as it stands in a file."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]
