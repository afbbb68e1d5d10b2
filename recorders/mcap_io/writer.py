"""The MCAP writer: crash-safe, appendable, and the only module that writes MCAP.

Messages are collected in a chunk; `flush` writes the chunk with its index in one write and syncs it, so that
flushed data stays readable even if the process is killed right afterwards. Records are encoded by the mcap library;
the file layer is our own, because mcap's writer keeps a chunk in memory until it is full, and cannot append.

Schemas and channels are declared in the chunk that first uses them and again in the next one, so that a damaged
chunk loses only its own messages.
"""

from __future__ import annotations

import errno
import os
import zlib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from importlib.metadata import version
from itertools import zip_longest
from pathlib import Path
from typing import Self, final

from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
)

from recorders.mcap_io.chunk import Chunk, Compression, PackedChunk
from recorders.mcap_io.crc32 import combined_crc
from recorders.mcap_io.file import create, reopen
from recorders.mcap_io.index import MAGIC, LogIndex, record_bytes
from workbench import __version__
from workbench.errors import CannotCreate, Failed

LIBRARY = f"lios-workbench/{__version__} mcap-python/{version('mcap')}"
CHUNK_BYTES = 1 << 20
WRITE_BACK_BYTES = 16 << 20
"""The disk begins with what was written whenever it is this much, so that the sync at the end waits for little."""
KEEP_FREE_BYTES = 16 << 20
"""Free disk space in bytes at which recording stops, so that the log can still be closed properly."""


class DiskFull(Failed):
    """The disk is full; flushed data is safe."""

    def __init__(self, path: Path | str, reason: str) -> None:
        self.reason = reason
        super().__init__(f"{path}: recording stopped ({reason}). What was flushed is kept; free some space.")


class AlreadyClosed(Failed):
    """The log has been closed or stopped."""

    def __init__(self, path: Path | str) -> None:
        super().__init__(f"{path}: this log is closed. Open another one to record more.")


@final
class McapWriter:
    """Writes one MCAP file. Not thread-safe.

    Args:
        path: the file to create.
        chunk_bytes: size in bytes beyond which a chunk is written, but not synced.
        compression: "zstd", "lz4" or "" for none.
        force: replace a file that exists.
        profile, library: header fields.
        keep_free_bytes: free disk space in bytes below which the file is closed properly and writing stops.

    Raises:
        OutputExists: the file exists and force is not set.
        CannotCreate: no permission, no room for the first bytes, or the folder is a file; no file is left behind.
        DiskFull: no room in a later call; the file ends with its last complete record.
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
        keep_free_bytes: int = KEEP_FREE_BYTES,
    ) -> None:
        self.path = Path(path)
        self._file = create(self.path, force=force)
        self._chunk_bytes = chunk_bytes
        self._compression: Compression = compression
        self._keep_free_bytes = keep_free_bytes
        self._index = LogIndex(header=Header(profile=profile, library=library))
        self._chunk = Chunk()
        self._repeat: list[Schema | Channel] = []
        self._offset = 0
        self._data_crc: int | None = 0
        self._closed = False
        self._old_end: tuple[int, bytes] | None = None
        try:
            self._put(MAGIC + record_bytes(Header(profile=profile, library=library)))
        except DiskFull as error:
            self._file.close()
            if self.path.is_file():
                self.path.unlink()
            raise CannotCreate(self.path, error.reason) from error

    @classmethod
    def append_to(cls, path: Path | str, index: LogIndex, *, size: int | None = None) -> Self:
        """A writer that appends to a closed log; only the summary is rewritten.

        If that fails because the disk is full, the log is restored.

        Args:
            index: the index of the log, as read.
            size: size of the log in bytes when its index was read.

        Raises:
            LogInUse: another process is writing it, or has changed it since its index was read.
        """
        writer = object.__new__(cls)
        writer.path = Path(path)
        writer._file = reopen(writer.path, size=size)
        writer._file.seek(index.data_end)
        writer._old_end = (index.data_end, writer._file.read())
        writer._file.seek(index.data_end)
        writer._chunk_bytes, writer._compression, writer._keep_free_bytes = CHUNK_BYTES, "zstd", 0
        writer._index, writer._chunk, writer._repeat = index, Chunk(), []
        writer._offset, writer._data_crc, writer._closed = index.data_end, index.data_crc or None, False
        return writer

    @property
    def index(self) -> LogIndex:
        """The index of the file so far, including buffered messages."""
        return self._index

    @property
    def bytes_written(self) -> int:
        return self._offset

    @property
    def bytes_in_hand(self) -> int:
        """Size of the buffered data, which a crash would lose."""
        return len(self._chunk.body)

    @property
    def closed(self) -> bool:
        return self._closed

    def declare(self, record: Schema | Channel) -> None:
        """Declare a schema or channel by the id that it has, which must be free."""
        self._check_open()
        self._index.learn(record)
        self._chunk.declare(record)

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """Declare a schema; returns its id, which is the same for equal schemas."""
        for known in self._index.schemas.values():
            if (known.name, known.encoding, known.data) == (name, encoding, data):
                return known.id
        schema = Schema(id=max(self._index.schemas, default=0) + 1, name=name, encoding=encoding, data=data)
        self.declare(schema)
        return schema.id

    def add_channel(
        self, topic: str, message_encoding: str, schema_id: int, metadata: Mapping[str, str] | None = None
    ) -> int:
        """Declare a channel; returns its id. Channels may share a topic. Schema id 0 means no schema."""
        channel = Channel(
            id=max(self._index.channels, default=0) + 1,
            topic=topic,
            message_encoding=message_encoding,
            metadata=dict(metadata or {}),
            schema_id=schema_id,
        )
        self.declare(channel)
        return channel.id

    def add_message(
        self,
        channel_id: int,
        data: bytes,
        *,
        log_time: int,
        publish_time: int | None = None,
        sequence: int | None = None,
        incompressible: bool = False,
    ) -> None:
        """Add a message to the current chunk.

        Args:
            log_time, publish_time: nanoseconds; publish_time defaults to log_time.
            sequence: defaults to a count per channel.
            incompressible: it is known not to be compressible; zstd does not attempt it where all of a chunk are.
        """
        self._check_open()
        before = self._index.count(channel_id, log_time)
        self._chunk.add(
            channel_id,
            before if sequence is None else sequence,
            log_time,
            log_time if publish_time is None else publish_time,
            data,
            incompressible=incompressible,
        )
        if len(self._chunk.body) >= self._chunk_bytes:
            self.flush(sync=False)

    def add_chunk(self, chunk: PackedChunk, declared: Iterable[Schema | Channel] = ()) -> None:
        """Write a chunk of another log as it stands, after the buffered messages.

        Args:
            declared: the schemas and channels that it declares. Others that it uses must have been declared before.
        """
        self.flush(sync=False)
        for record in declared:
            self._index.learn(record)
        parts, entry = chunk.at(self._offset)
        self._put_chunk(parts, entry, crcs=(None, chunk.data_crc, None))
        for channel_id, stamps in chunk.index.items():
            self._index.count_all(channel_id, stamps)

    def add_attachment(self, name: str, media_type: str, data: bytes, *, log_time: int, create_time: int = 0) -> None:
        """Write an attachment at once, outside chunks; buffered messages stay buffered."""
        self._check_open()
        record = record_bytes(
            Attachment(create_time=create_time, log_time=log_time, name=name, media_type=media_type, data=data)
        )
        entry = AttachmentIndex(
            offset=self._offset,
            length=len(record),
            log_time=log_time,
            create_time=create_time,
            data_size=len(data),
            name=name,
            media_type=media_type,
        )
        self._put(record)
        self._index.attachments.append(entry)

    def add_metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record at once, outside chunks; buffered messages stay buffered."""
        self._check_open()
        record = record_bytes(Metadata(name=name, metadata=dict(values)))
        entry = MetadataIndex(offset=self._offset, length=len(record), name=name)
        self._put(record)
        self._index.metadata.append(entry)

    def flush(self, *, sync: bool = True) -> None:
        """Write buffered messages as one chunk with its index; with `sync`, wait until they are on disk."""
        self._check_open()
        if self._chunk.body:
            data, crc, entry = self._chunk.packed(self._offset, self._compression, repeated=self._repeat)
            self._put_chunk((data,), entry, crcs=(crc,))
            self._repeat, self._chunk = self._chunk.declared, Chunk()
        if sync:
            self._sync()

    def close(self, *, sync: bool = True) -> None:
        """Flush, write the summary and close; with `sync`, wait until all is on disk. Safe to call twice."""
        if self._closed:
            return
        self.flush(sync=False)
        self._finish(sync=sync)

    def abandon(self) -> None:
        """Close the file without a summary, as a crash would leave it. Safe to call twice."""
        self._closed = True
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _finish(self, *, sync: bool = True) -> None:
        end = record_bytes(DataEnd(data_section_crc=self._data_crc or 0))
        self._put(end + self._index.to_bytes(self._offset + len(end)))
        if self._old_end is not None:
            self._file.truncate(self._offset)
        if sync:
            self._sync()
        self._closed = True
        self._file.close()

    def _check_open(self) -> None:
        if self._closed:
            raise AlreadyClosed(self.path)

    def _sync(self) -> None:
        try:
            os.fsync(self._file.fileno())
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # a pipe or device cannot be synced
                raise DiskFull(self.path, error.strerror or str(error)) from error

    def _put_chunk(
        self, parts: Sequence[bytes | bytearray | memoryview], entry: ChunkIndex, *, crcs: Sequence[int | None] = ()
    ) -> None:
        if self._no_room_for(sum(map(len, parts))):
            self._stop_in_time(f"less than {self._keep_free_bytes >> 20} MiB of the disk are free")
        self._put(*parts, crcs=crcs)
        self._index.chunks.append(entry)

    def _no_room_for(self, size: int) -> bool:
        if not self._keep_free_bytes:
            return False
        disk = os.fstatvfs(self._file.fileno())
        return disk.f_bavail * disk.f_frsize < self._keep_free_bytes + size and disk.f_blocks > 0

    def _stop_in_time(self, reason: str) -> None:
        """Discard buffered messages, close the file properly, and raise DiskFull."""
        self._forget_messages_in_hand()
        self._finish()
        raise DiskFull(self.path, reason)

    def _forget_messages_in_hand(self) -> None:
        for channel_id, entries in self._chunk.index.items():
            self._index.counts[channel_id] -= len(entries)
        stamps = [
            stamp
            for chunk in self._index.chunks
            for stamp in (chunk.message_start_time, chunk.message_end_time)
            if chunk.message_index_offsets
        ]
        self._index.first_ns, self._index.last_ns = min(stamps, default=0), max(stamps, default=0)
        self._chunk = Chunk()

    def _put(self, *parts: bytes | bytearray | memoryview, crcs: Sequence[int | None] = ()) -> None:
        """Write all or nothing: after a failure the file ends with its last complete record.

        Args:
            crcs: checksums of the parts, as far as they are known.
        """
        try:
            for part in parts:
                view = memoryview(part)
                while view:
                    view = view[self._file.write(view) or 0 :]
        except OSError as error:
            self._cut_back()
            raise DiskFull(self.path, error.strerror or str(error)) from error
        self._begin_write_back(sum(map(len, parts)))
        for part, crc in zip_longest(parts, crcs):
            self._offset += len(part)
            if self._data_crc is not None:  # None: appending to a log without a checksum
                known = crc is not None
                self._data_crc = (
                    combined_crc(self._data_crc, crc, len(part)) if known else zlib.crc32(part, self._data_crc)
                )

    def _begin_write_back(self, size: int) -> None:
        """Let the disk begin with a block of WRITE_BACK_BYTES when the next bytes complete it.

        POSIX_FADV_DONTNEED begins to write what is not on disk yet, and waits for nothing.
        """
        ends = (self._offset + size) // WRITE_BACK_BYTES * WRITE_BACK_BYTES
        begins = self._offset // WRITE_BACK_BYTES * WRITE_BACK_BYTES
        if ends > begins and hasattr(os, "posix_fadvise"):
            with suppress(OSError):  # a pipe or device
                os.posix_fadvise(self._file.fileno(), begins, ends - begins, os.POSIX_FADV_DONTNEED)

    def _cut_back(self) -> None:
        self._closed = True
        try:
            if self._old_end is not None:
                self._offset, end = self._old_end
                self._file.seek(self._offset)
                self._offset += self._file.write(end) or 0
            self._file.truncate(self._offset)
        except OSError:
            pass  # a device cannot be truncated; readers detect the incomplete record
        finally:
            self._file.close()
