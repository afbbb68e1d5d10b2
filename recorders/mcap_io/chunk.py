"""Chunks of messages: collected in memory, then encoded with checksum and message index and written in one piece."""

from __future__ import annotations

import struct
import threading
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import lz4.frame
import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Schema

from recorders.mcap_io.crc32 import combined_crc
from recorders.mcap_io.index import record_bytes
from recorders.mcap_io.stored_frame import store, stored_frame

Compression = Literal["zstd", "lz4", ""]
ZSTD_LEVEL = 3


@dataclass(slots=True)
class Chunk:
    """Messages not yet on disk, with the schemas and channels that they use for the first time."""

    body: bytearray = field(default_factory=bytearray)
    index: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    declared: list[Schema | Channel] = field(default_factory=list)
    start_ns: int = 0
    end_ns: int = 0
    messages: int = 0
    incompressible: bool = True
    """Whether all messages are known not to be compressible."""

    def declare(self, record: Schema | Channel) -> None:
        self.body += record_bytes(record)
        self.declared.append(record)

    def add(
        self,
        channel_id: int,
        sequence: int,
        log_time: int,
        publish_time: int,
        data: bytes | memoryview,
        *,
        incompressible: bool = False,
    ) -> None:
        entries = self.index.get(channel_id)
        if entries is None:
            entries = self.index[channel_id] = []
        entries.append((log_time, len(self.body)))
        self.body += _MESSAGE_HEAD.pack(
            Opcode.MESSAGE, 22 + len(data), channel_id, sequence & 0xFFFFFFFF, log_time, publish_time
        )
        self.body += data
        self.start_ns = min(self.start_ns, log_time) if self.messages else log_time
        self.end_ns = max(self.end_ns, log_time)
        self.messages += 1
        self.incompressible &= incompressible

    def packed(
        self, offset: int, compression: Compression, *, repeated: Sequence[Schema | Channel] = ()
    ) -> tuple[bytes, int | None, ChunkIndex]:
        """The chunk with its message indexes as bytes, their checksum where it costs nothing, and the chunk's entry
        for the summary.

        Args:
            offset: byte offset of the chunk in the file.
            repeated: declarations of the previous chunk, written again so that a damaged chunk affects only itself.
        """
        body: bytes | bytearray = self.body
        index = self.index
        if repeated:
            again = b"".join(record_bytes(record) for record in repeated)
            body = again + body
            index = {number: [(stamp, at + len(again)) for stamp, at in found] for number, found in index.items()}
        stored = None
        if compression == "zstd" and self.incompressible and self.messages:
            stored = store(body)
            data = stored.frame
        else:
            data = compress(body, compression)
            if compression == "zstd" and len(data) >= len(body):
                stored = stored_frame(data)
        chunk = PackedChunk(
            data=data,
            compression=compression,
            size=len(body),
            crc=zlib.crc32(body) if stored is None else stored.crc,
            start_ns=self.start_ns,
            end_ns=self.end_ns,
            index=index,
        )
        (head, _, indexes), entry = chunk.at(offset)
        crc = None
        if stored is not None:  # one pass gives the checksums of the chunk and of the file
            crc = zlib.crc32(indexes, combined_crc(zlib.crc32(head), stored.frame_crc(), len(data)))
        return b"".join((head, data, indexes)), crc, entry


@dataclass(frozen=True, slots=True, kw_only=True)
class PackedChunk:
    """A compressed chunk, of this log or as it stands in another one.

    Attributes:
        size, crc: of the records inside, before compression.
        start_ns, end_ns: first and last log time; 0 without messages.
        index: log times and offsets in the chunk, for each channel id.
        data_crc: checksum of `data`; None where it is not known.
    """

    data: bytes | bytearray | memoryview
    compression: str
    size: int
    crc: int
    start_ns: int
    end_ns: int
    index: Mapping[int, Sequence[tuple[int, int]]]
    data_crc: int | None = None

    def at(self, offset: int) -> tuple[tuple[bytes, bytes | bytearray | memoryview, bytes], ChunkIndex]:
        """The chunk with its message indexes, in pieces, and its entry for the summary."""
        name = self.compression.encode()
        head = struct.pack(
            f"<BQQQQLL{len(name)}sQ",
            Opcode.CHUNK,
            40 + len(name) + len(self.data),
            self.start_ns,
            self.end_ns,
            self.size,
            self.crc,
            len(name),
            name,
            len(self.data),
        )
        length, offsets, indexes = len(head) + len(self.data), dict[int, int](), bytearray()
        for channel_id, entries in self.index.items():
            offsets[channel_id] = offset + length + len(indexes)
            indexes += _message_index(channel_id, entries)
        entry = ChunkIndex(
            chunk_length=length,
            chunk_start_offset=offset,
            compression=self.compression,
            compressed_size=len(self.data),
            message_end_time=self.end_ns,
            message_index_length=len(indexes),
            message_index_offsets=offsets,
            message_start_time=self.start_ns,
            uncompressed_size=self.size,
        )
        return (head, self.data, bytes(indexes)), entry


def _message_index(channel_id: int, entries: Sequence[tuple[int, int]]) -> bytes:
    """A message index record in one piece: mcap's record layer writes it number by number."""
    size = 16 * len(entries)
    numbers = [number for entry in entries for number in entry]
    return struct.pack(f"<BQHL{len(numbers)}Q", Opcode.MESSAGE_INDEX, size + 6, channel_id, size, *numbers)


def compress(body: bytes | bytearray, compression: Compression) -> bytes | bytearray:
    if compression == "zstd":
        return _zstd().compress(body)
    if compression == "lz4":
        return lz4.frame.compress(body)
    return body


def _zstd() -> zstandard.ZstdCompressor:
    """One compressor for each thread: its tables are large, and a new one would touch all their memory again."""
    machine: zstandard.ZstdCompressor | None = getattr(_OF_THREAD, "machine", None)
    if machine is None:
        machine = _OF_THREAD.machine = zstandard.ZstdCompressor(level=ZSTD_LEVEL)
    return machine


_OF_THREAD = threading.local()
_MESSAGE_HEAD = struct.Struct("<BQHIQQ")
