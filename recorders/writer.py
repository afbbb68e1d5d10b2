"""How does a log reach the disk, and stay readable whatever happens? The one file that writes MCAP.

Messages gather in a chunk; `flush` writes the chunk with its index in one write and syncs it. What was flushed is
on disk and can be read even when the process is killed in the next instant. The record layer is mcap's; the file
layer is ours, because mcap's own writer keeps a chunk in memory until it is full and cannot append.

Schemas and channels are declared in the chunk that first needs them and once more in the next one, so that a
single damaged chunk costs its own messages and no others.
"""

from __future__ import annotations

import errno
import os
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import BinaryIO, Literal

import lz4.frame
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
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
    SummaryOffset,
)

from workbench import __version__
from workbench.errors import Failed, OutputExists

MAGIC = b"\x89MCAP0\r\n"
LIBRARY = f"lios-workbench/{__version__} mcap-python/{version('mcap')}"
CHUNK_BYTES = 1 << 20
Compression = Literal["zstd", "lz4", ""]


class DiskFull(Failed):
    """The disk has no room left; what was flushed is safe."""

    def __init__(self, path: Path | str, reason: str) -> None:
        super().__init__(
            f"{path}: cannot write any more ({reason}). What was recorded so far is kept; free some space."
        )


class AlreadyClosed(Failed):
    """Writing to a log that was closed or stopped."""

    def __init__(self, path: Path | str) -> None:
        super().__init__(f"{path}: this log is closed. Open another one to record more.")


@dataclass(slots=True)
class _Chunk:
    """Messages that are not on disk yet."""

    body: bytearray = field(default_factory=bytearray)
    index: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    start_ns: int = 0
    end_ns: int = 0
    messages: int = 0


class McapWriter:
    """Writes one MCAP file. Not thread-safe: one thread owns it.

    Args:
        path: the file to make.
        chunk_bytes: a chunk is flushed, but not synced, when it grows beyond this.
        compression: "zstd", "lz4" or "" for none.
        force: replace a file that exists.
        profile, library: of the header.

    Raises:
        OutputExists: the file exists and force is not set.
        DiskFull: nothing more can be written; the file is cut back to its last whole record.
    """

    def __init__(
        self,
        path: Path | str,
        *,
        chunk_bytes: int = CHUNK_BYTES,
        compression: Compression = "zstd",
        force: bool = False,
        profile: str = "",
        library: str = LIBRARY,
    ) -> None:
        self.path = Path(path)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self._file: BinaryIO = open(self.path, "wb" if force else "xb", buffering=0)  # noqa: SIM115
        except FileExistsError:
            raise OutputExists(self.path) from None
        self._chunk_bytes = chunk_bytes
        self._compression = compression
        self._zstd = zstandard.ZstdCompressor(level=3)
        self._offset = 0
        self._data_crc = 0
        self._chunk = _Chunk()
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._declare_again: list[McapRecord] = []
        self._declared: list[McapRecord] = []
        self._chunk_indexes: list[ChunkIndex] = []
        self._attachment_indexes: list[AttachmentIndex] = []
        self._metadata_indexes: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._first_ns: int | None = None
        self._last_ns = 0
        self._closed = False
        self._put(MAGIC + record_bytes(Header(profile=profile, library=library)))

    @property
    def bytes_written(self) -> int:
        """What the file holds so far; messages not yet flushed are not counted."""
        return self._offset

    @property
    def pending_messages(self) -> int:
        """Messages that a crash would lose now."""
        return self._chunk.messages

    @property
    def pending_bytes(self) -> int:
        return len(self._chunk.body)

    @property
    def closed(self) -> bool:
        return self._closed

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Declares a schema; returns its id, the same one for the same schema."""
        for known in self._schemas.values():
            if (known.name, known.encoding, known.data) == (name, encoding, data):
                return known.id
        schema = Schema(id=len(self._schemas) + 1, name=name, encoding=encoding, data=data)
        self._schemas[schema.id] = schema
        self._declare(schema)
        return schema.id

    def add_channel(
        self, topic: str, message_encoding: str, schema_id: int, metadata: Mapping[str, str] | None = None
    ) -> int:
        """Declares a channel; returns its id. Two channels may share a topic."""
        channel = Channel(
            id=len(self._channels) + 1,
            topic=topic,
            message_encoding=message_encoding,
            metadata=dict(metadata or {}),
            schema_id=schema_id,
        )
        self._channels[channel.id] = channel
        self._declare(channel)
        return channel.id

    def add_message(
        self,
        channel_id: int,
        data: bytes,
        *,
        log_time: int,
        publish_time: int | None = None,
        sequence: int | None = None,
    ) -> None:
        """Adds a message to the chunk in hand.

        Args:
            log_time, publish_time: nanoseconds; publish_time is log_time unless given.
            sequence: counts per channel unless given.
        """
        self._check_open()
        count = self._counts.get(channel_id, 0)
        self._counts[channel_id] = count + 1
        chunk = self._chunk
        chunk.index.setdefault(channel_id, []).append((log_time, len(chunk.body)))
        chunk.body += _MESSAGE_HEAD.pack(
            Opcode.MESSAGE,
            22 + len(data),
            channel_id,
            (count if sequence is None else sequence) & 0xFFFFFFFF,
            log_time,
            log_time if publish_time is None else publish_time,
        )
        chunk.body += data
        chunk.start_ns = min(chunk.start_ns, log_time) if chunk.messages else log_time
        chunk.end_ns = max(chunk.end_ns, log_time)
        chunk.messages += 1
        self._first_ns = log_time if self._first_ns is None else min(self._first_ns, log_time)
        self._last_ns = max(self._last_ns, log_time)
        if len(chunk.body) >= self._chunk_bytes:
            self.flush(sync=False)

    def add_attachment(self, name: str, media_type: str, data: bytes, *, log_time: int, create_time: int = 0) -> None:
        """Writes an attachment at once, outside chunks."""
        self._check_open()
        self.flush(sync=False)
        attachment = Attachment(
            create_time=create_time, log_time=log_time, name=name, media_type=media_type, data=data
        )
        record = record_bytes(attachment)
        index = AttachmentIndex(
            offset=self._offset,
            length=len(record),
            log_time=log_time,
            create_time=create_time,
            data_size=len(data),
            name=name,
            media_type=media_type,
        )
        self._put(record)
        self._attachment_indexes.append(index)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Writes a metadata record at once, outside chunks."""
        self._check_open()
        self.flush(sync=False)
        record = record_bytes(Metadata(name=name, metadata=dict(values)))
        index = MetadataIndex(offset=self._offset, length=len(record), name=name)
        self._put(record)
        self._metadata_indexes.append(index)

    def flush(self, *, sync: bool = True) -> None:
        """Writes what is in hand as one chunk with its index; with sync, waits until the disk has it."""
        self._check_open()
        if self._chunk.body:
            self._write_chunk()
        if sync:
            self.sync()

    def sync(self) -> None:
        try:
            os.fsync(self._file.fileno())
        except OSError as error:
            if error.errno != errno.EINVAL:  # a pipe or a special file cannot be synced
                raise DiskFull(self.path, error.strerror or str(error)) from error

    def close(self) -> None:
        """Flushes, writes the summary and closes. Safe to call twice."""
        if self._closed:
            return
        self.flush(sync=False)
        self._put(record_bytes(DataEnd(data_section_crc=self._data_crc)))
        self._put(self._summary())
        self.sync()
        self._closed = True
        self._file.close()

    def abandon(self) -> None:
        """Closes the file as it is, without a summary: what a crash would leave. Safe to call twice."""
        self._closed = True
        self._file.close()

    def _check_open(self) -> None:
        if self._closed:
            raise AlreadyClosed(self.path)

    def _declare(self, record: McapRecord) -> None:
        self._check_open()
        self._chunk.body += record_bytes(record)
        self._declared.append(record)

    def _write_chunk(self) -> None:
        chunk = self._chunk
        body = b"".join([*(record_bytes(record) for record in self._declare_again), b""])
        shift = len(body)
        body = body + bytes(chunk.body)
        packed = self._compress(body)
        compression = self._compression.encode()
        head = struct.pack(
            f"<BQQQQLL{len(compression)}sQ",
            Opcode.CHUNK,
            8 + 8 + 8 + 4 + 4 + len(compression) + 8 + len(packed),
            chunk.start_ns,
            chunk.end_ns,
            len(body),
            zlib.crc32(body),
            len(compression),
            compression,
            len(packed),
        )
        offsets: dict[int, int] = {}
        index_bytes = bytearray()
        chunk_length = len(head) + len(packed)
        for channel_id, entries in chunk.index.items():
            offsets[channel_id] = self._offset + chunk_length + len(index_bytes)
            index_bytes += record_bytes(
                MessageIndex(channel_id=channel_id, records=[(stamp, at + shift) for stamp, at in entries])
            )
        index = ChunkIndex(
            chunk_length=chunk_length,
            chunk_start_offset=self._offset,
            compression=self._compression,
            compressed_size=len(packed),
            message_end_time=chunk.end_ns,
            message_index_length=len(index_bytes),
            message_index_offsets=offsets,
            message_start_time=chunk.start_ns,
            uncompressed_size=len(body),
        )
        self._put(b"".join((head, packed, index_bytes)))
        self._chunk_indexes.append(index)
        self._declare_again, self._declared = self._declared, []
        self._chunk = _Chunk()

    def _compress(self, body: bytes) -> bytes:
        if self._compression == "zstd":
            return self._zstd.compress(body)
        if self._compression == "lz4":
            return lz4.frame.compress(body)
        return body

    def _put(self, data: bytes) -> None:
        """Writes all or nothing: after a failure the file ends with its last whole record."""
        view = memoryview(data)
        try:
            while view:
                view = view[self._file.write(view) or 0 :]
        except OSError as error:
            self._cut_back()
            raise DiskFull(self.path, error.strerror or str(error)) from error
        self._offset += len(data)
        self._data_crc = zlib.crc32(data, self._data_crc)

    def _cut_back(self) -> None:
        try:
            self._file.truncate(self._offset)
            self._file.seek(self._offset)
        except OSError:
            pass
        self._closed = True
        self._file.close()

    def _summary(self) -> bytes:
        start = self._offset
        statistics = Statistics(
            attachment_count=len(self._attachment_indexes),
            channel_count=len(self._channels),
            channel_message_counts=dict(sorted(self._counts.items())),
            chunk_count=len(self._chunk_indexes),
            message_count=sum(self._counts.values()),
            message_end_time=self._last_ns,
            message_start_time=self._first_ns or 0,
            metadata_count=len(self._metadata_indexes),
            schema_count=len(self._schemas),
        )
        groups: list[tuple[Opcode, list[McapRecord]]] = [
            (Opcode.SCHEMA, [*self._schemas.values()]),
            (Opcode.CHANNEL, [*self._channels.values()]),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, [*self._chunk_indexes]),
            (Opcode.ATTACHMENT_INDEX, [*self._attachment_indexes]),
            (Opcode.METADATA_INDEX, [*self._metadata_indexes]),
        ]
        body, offsets = bytearray(), bytearray()
        for opcode, records in groups:
            if not records:
                continue
            at = len(body)
            for record in records:
                body += record_bytes(record)
            offsets += record_bytes(
                SummaryOffset(group_opcode=opcode, group_start=start + at, group_length=len(body) - at)
            )
        offset_start = start + len(body)
        body += offsets
        footer_head = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offset_start)
        footer = Footer(
            summary_start=start, summary_offset_start=offset_start, summary_crc=zlib.crc32(bytes(body) + footer_head)
        )
        return bytes(body) + record_bytes(footer) + MAGIC


def record_bytes(record: McapRecord) -> bytes:
    """One record as mcap writes it."""
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


_MESSAGE_HEAD = struct.Struct("<BQHIQQ")
