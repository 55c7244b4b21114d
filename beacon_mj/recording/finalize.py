"""A finished MCAP file: its records, then where they are."""

import struct
import zlib
from itertools import pairwise

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
    McapRecord,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from beacon_mj.recording.container import MAGIC

_FOOTER_START = struct.Struct("<BQQQ")


class WholeFile:
    """A finished file in memory: `data`, once `end` was called."""

    def __init__(self) -> None:
        """Begin with no record."""
        self.data = bytearray(MAGIC)
        self._indexes: list[ChunkIndex | AttachmentIndex | MetadataIndex] = []
        self._counts: dict[int, int] = {}

    def put(self, record: McapRecord) -> None:
        """Append a record, and remember where it is."""
        offset, data = len(self.data), record_bytes(record)
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
        indexes = sorted(self._indexes, key=lambda index: type(index).__name__)
        for record in (*defined, self._statistics(defined), *indexes):
            self.data += record_bytes(record)
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


def record_bytes(record: McapRecord) -> bytes:
    """Return a record as it stands in a file."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]
