"""The records of an MCAP file that may be unfinished, damaged or hostile.

Everything that is read passes a checksum where the format has one, and nothing makes
the reader allocate more than `MAX_CHUNK_BYTES` at once or `MAX_LOG_BYTES` in all.
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

MAX_CHUNK_BYTES = 16 << 20  #: Largest chunk, declared or real [bytes].
MAX_LOG_BYTES = 512 << 20  #: Largest log, on disk or unpacked [bytes].
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
            size = path.stat().st_size
            if size > MAX_LOG_BYTES:
                raise LogError(
                    f"{path}: expected a log of at most {MAX_LOG_BYTES} bytes but it "
                    f"has {size}."
                )
            self._data = path.read_bytes()
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
        unpacked = 0
        for record in reader.records:
            if isinstance(record, Chunk):
                chunk = self._unpack(record)
                unpacked += len(chunk.data)
                self._check_total(unpacked)
                yield from self._inside(chunk)
            else:
                if isinstance(record, Attachment):
                    record = self._attachment(record)
                    unpacked += len(record.data)
                    self._check_total(unpacked)
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
            data = zlib.decompressobj(wbits=31).decompress(data, MAX_CHUNK_BYTES)
        if not data:
            raise LogError(f"{self.path}: attachment {attachment.name!r} is empty.")
        return replace(attachment, name=name, data=data)

    def _check_total(self, unpacked: int) -> None:
        """Check the number of bytes that came out so far."""
        if unpacked > MAX_LOG_BYTES:
            raise LogError(
                f"{self.path}: expected at most {MAX_LOG_BYTES} bytes when unpacked "
                "but there are more."
            )

    def _check_summary(self, footer: Footer) -> None:
        """Check the checksum of the summary, which nothing here uses otherwise."""
        if footer.summary_start == 0 or footer.summary_crc == 0:
            return
        end = len(self._data) - len(MAGIC) - 4
        if zlib.crc32(self._data[footer.summary_start : end]) != footer.summary_crc:
            raise LogError(f"{self.path}: the log is damaged: its summary's CRC fails.")
