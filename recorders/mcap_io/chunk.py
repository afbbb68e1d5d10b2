"""Chunks of messages: collected in memory, then encoded with checksum and message index and written in one piece."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import lz4.frame
import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, MessageIndex, Schema

from recorders.mcap_io.index import record_bytes

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

    def declare(self, record: Schema | Channel) -> None:
        self.body += record_bytes(record)
        self.declared.append(record)

    def add(self, channel_id: int, sequence: int, log_time: int, publish_time: int, data: bytes) -> None:
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

    def packed(
        self, offset: int, compression: Compression, *, repeated: Sequence[Schema | Channel] = ()
    ) -> tuple[bytes, ChunkIndex]:
        """The chunk with its message indexes as bytes, and its entry for the summary.

        Args:
            offset: byte offset of the chunk in the file.
            repeated: declarations of the previous chunk, written again so that a damaged chunk affects only itself.
        """
        again = b"".join(record_bytes(record) for record in repeated)
        body = again + bytes(self.body)
        data = compress(body, compression)
        name = compression.encode()
        head = struct.pack(
            f"<BQQQQLL{len(name)}sQ",
            Opcode.CHUNK,
            40 + len(name) + len(data),
            self.start_ns,
            self.end_ns,
            len(body),
            zlib.crc32(body),
            len(name),
            name,
            len(data),
        )
        length, offsets, indexes = len(head) + len(data), dict[int, int](), bytearray()
        for channel_id, entries in self.index.items():
            offsets[channel_id] = offset + length + len(indexes)
            shifted = [(stamp, at + len(again)) for stamp, at in entries]
            indexes += record_bytes(MessageIndex(channel_id=channel_id, records=shifted))
        entry = ChunkIndex(
            chunk_length=length,
            chunk_start_offset=offset,
            compression=compression,
            compressed_size=len(data),
            message_end_time=self.end_ns,
            message_index_length=len(indexes),
            message_index_offsets=offsets,
            message_start_time=self.start_ns,
            uncompressed_size=len(body),
        )
        return b"".join((head, data, indexes)), entry


def compress(body: bytes, compression: Compression) -> bytes:
    if compression == "zstd":
        return zstandard.ZstdCompressor(level=ZSTD_LEVEL).compress(body)
    if compression == "lz4":
        return lz4.frame.compress(body)
    return body


_MESSAGE_HEAD = struct.Struct("<BQHIQQ")
