"""A clean log from one that broke off."""

import os
from pathlib import Path

from mcap.records import (
    Attachment,
    Channel,
    McapRecord,
    Message,
    Metadata,
    Schema,
)
from mcap.writer import Writer

from beacon_mj.errors import LogError
from beacon_mj.files import replacing
from beacon_mj.recording.container import Container
from beacon_mj.recording.reader import read_log


def recover(part: str | Path, out: str | Path) -> int:
    """Write all whole steps of an unfinished log as a well-formed MCAP file.

    The result opens in every MCAP tool. It stays an unfinished log: it has no result.

    Args:
        part: The log that broke off; it is left as it is.
        out: The file to write, which must not exist; written whole or not at all.

    Returns:
        The number of whole control steps recovered.

    Raises:
        LogError: If nothing can be recovered, or `out` cannot be written.
    """
    part, out = Path(part), Path(out)
    steps = read_log(part).steps
    if os.path.lexists(out):
        raise LogError(f"{out}: cannot write: File exists")
    with replacing(out, LogError) as whole, whole.open("xb") as file:
        _copy(Container(part), Writer(file, enable_data_crcs=True))
    return steps


def _copy(container: Container, writer: Writer) -> None:
    """Copy records up to the last whole step."""
    records = list(container.records())
    topics = {r.id: r.topic for r in records if isinstance(r, Channel)}
    last = max(
        k
        for k, r in enumerate(records)
        if isinstance(r, Message) and topics.get(r.channel_id) == "/step"
    )
    target: _Copy = _Copy(writer)
    writer.start(library="beacon-mj recover")
    for k, record in enumerate(records):
        if k <= last or not isinstance(record, Message):
            target.put(record)
    writer.finish()  # type: ignore[no-untyped-call]


class _Copy:
    """Writes records with the identifiers of another file."""

    def __init__(self, writer: Writer) -> None:
        self._writer = writer
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, int] = {}

    def put(self, record: McapRecord) -> None:
        """Write one record; records of the summary are made anew."""
        writer = self._writer
        match record:
            case Schema() if record.id not in self._schemas:
                self._schemas[record.id] = writer.register_schema(
                    record.name, record.encoding, record.data
                )
            case Channel() if record.id not in self._channels:
                self._channels[record.id] = writer.register_channel(
                    record.topic,
                    record.message_encoding,
                    self._schemas[record.schema_id],
                    record.metadata,
                )
            case Message():
                writer.add_message(
                    self._channels[record.channel_id],
                    record.log_time,
                    record.data,
                    record.publish_time,
                    record.sequence,
                )
            case Attachment():
                writer.add_attachment(
                    record.create_time,
                    record.log_time,
                    record.name,
                    record.media_type,
                    record.data,
                )
            case Metadata():
                writer.add_metadata(record.name, record.metadata)
