"""The records of an MCAP file that may be unfinished, damaged or hostile.

Everything that is read passes a checksum where the format has one, and what is unpacked
stays in proportion to the file: `SPARE_BYTES`, and `UNPACKED` times its size.
"""

import struct
import zlib
from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Attachment, Chunk, Footer, McapRecord
from mcap.stream_reader import StreamReader, breakup_chunk

from beacon_mj.errors import LogError
from beacon_mj.regular_files import read_regular

MAX_CHUNK_BYTES = 16 << 20  #: Largest chunk, declared or real [bytes].
MAX_LOG_BYTES = 512 << 20  #: Largest log, on disk or unpacked [bytes].
SPARE_BYTES = 4 << 20  #: That messages may have unpacked in any log [bytes].
UNPACKED = 16  #: And times the file's size; logs of episodes take up to 3.
MAX_ATTACHMENTS = 8  #: Scene and world are two; each may be as large as a chunk.
PACKED = ".gz"  #: Ending of the name of an attachment that is packed.
MAGIC = b"\x89MCAP0\r\n"
_FOOTER_BYTES = 9 + 20 + len(MAGIC)


class _Exact(BytesIO):
    """Bytes that are read in full or not at all."""

    def read(self, size: int | None = -1, /) -> bytes:
        data = super().read(size)
        if size is not None and len(data) < size:
            raise EndOfFile
        return data


class Container:
    """One MCAP file.

    Attributes:
        path: Where it is.
        whole: Whether it ends as a finished MCAP file does.
    """

    def __init__(self, path: Path) -> None:
        """Read the file. Raises LogError if it cannot be or is no MCAP file."""
        self.path = path
        try:
            self._data = read_regular(path, MAX_LOG_BYTES)
        except OSError as error:
            raise LogError(f"{path}: cannot read the log: {error.strerror}") from error
        if not self._data.startswith(MAGIC):
            raise LogError(
                f"{path}: expected an MCAP file but it begins with {self._data[:8]!r}."
            )
        self.whole = len(self._data) > 2 * len(MAGIC) and self._data.endswith(MAGIC)

    def records(self) -> Iterator[McapRecord]:
        """Yield the records in order, those of chunks one by one.

        An unfinished file ends with its last whole record.

        Raises:
            LogError: If a checksum fails, a record is malformed or too large, or a
                file that has an end breaks off before it.
        """
        try:
            yield from self._checked()
        except EndOfFile:
            if self.whole:
                raise LogError(
                    f"{self.path}: expected whole records up to the end of the file "
                    "but one breaks off: the log is damaged."
                ) from None
        except (
            McapError,
            ValueError,
            struct.error,
            zlib.error,
            zstandard.ZstdError,
        ) as error:
            raise LogError(f"{self.path}: the log is damaged: {error}.") from error

    def _checked(self) -> Iterator[McapRecord]:
        reader = StreamReader(
            _Exact(self._data),
            emit_chunks=True,
            validate_crcs=True,
            record_size_limit=MAX_CHUNK_BYTES,
        )
        unpacked = attachments = 0
        for record in reader.records:
            if isinstance(record, Chunk):
                chunk = self._unpack(record)
                unpacked += len(chunk.data)
                self._check_total(unpacked)
                yield from self._inside(chunk)
            else:
                if isinstance(record, Attachment):
                    attachments += 1
                    self._check_attachments(attachments)
                    record = self._attachment(record)
                if isinstance(record, Footer):
                    self._check_summary(record)
                yield record

    def _inside(self, chunk: Chunk) -> list[McapRecord]:
        """Return the records of an unpacked chunk."""
        try:
            return breakup_chunk(chunk, validate_crc=True)
        except EndOfFile:
            raise LogError(
                f"{self.path}: expected whole records in a chunk but one breaks off: "
                "the log is damaged."
            ) from None

    def _unpack(self, chunk: Chunk) -> Chunk:
        """Return a chunk with its data unpacked, never more than declared."""
        size = chunk.uncompressed_size
        if size > MAX_CHUNK_BYTES:
            raise LogError(
                f"{self.path}: expected chunks of at most {MAX_CHUNK_BYTES} bytes but "
                f"one declares {size}."
            )
        data = chunk.data
        if chunk.compression == "zstd":
            with zstandard.ZstdDecompressor().stream_reader(BytesIO(data)) as source:
                data = source.read(size + 1)
        elif chunk.compression:
            raise LogError(
                f"{self.path}: expected chunks packed with 'zstd' but one is packed "
                f"with {chunk.compression!r}."
            )
        if len(data) != size:
            raise LogError(
                f"{self.path}: expected a chunk of {size} bytes, as it declares, but "
                f"it has {'more' if len(data) > size else len(data)}."
            )
        return replace(chunk, data=data, compression="")

    def _attachment(self, attachment: Attachment) -> Attachment:
        """Return an attachment, one that is packed (`.gz`) as what is in it."""
        name, data = attachment.name, attachment.data
        if name.endswith(PACKED):
            name = name.removesuffix(PACKED)
            stream = zlib.decompressobj(wbits=31)
            data = stream.decompress(data, MAX_CHUNK_BYTES)
            if not stream.eof:
                raise LogError(
                    f"{self.path}: expected attachment {name!r} to be whole and at "
                    f"most {MAX_CHUNK_BYTES} bytes but it is not."
                )
        if not data:
            raise LogError(f"{self.path}: attachment {attachment.name!r} is empty.")
        return replace(attachment, name=name, data=data)

    def _check_total(self, unpacked: int) -> None:
        """Check the number of bytes that came out so far."""
        limit = min(MAX_LOG_BYTES, SPARE_BYTES + UNPACKED * len(self._data))
        if unpacked > limit:
            raise LogError(
                f"{self.path}: expected messages of at most {limit} bytes in a log of "
                f"{len(self._data)} bytes but there are more."
            )

    def _check_attachments(self, count: int) -> None:
        if count > MAX_ATTACHMENTS:
            raise LogError(
                f"{self.path}: expected at most {MAX_ATTACHMENTS} attachments but "
                "there are more."
            )

    def _check_summary(self, footer: Footer) -> None:
        """Check the checksum of the summary, which nothing here uses otherwise."""
        if footer.summary_start == 0 or footer.summary_crc == 0:
            return
        end = len(self._data) - len(MAGIC) - 4
        if zlib.crc32(self._data[footer.summary_start : end]) != footer.summary_crc:
            raise LogError(f"{self.path}: the log is damaged: its summary's CRC fails.")
