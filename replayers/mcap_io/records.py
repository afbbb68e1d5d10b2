"""Parsers of MCAP records: every length is checked before anything is allocated.

mcap's own record layer parses the small records; messages and chunks, which hold most of the bytes, are parsed here.
"""

from __future__ import annotations

import io
import re
import struct
import threading
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import NamedTuple, Protocol

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
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

from workbench.log_schema.run_info import is_intact

MAX_RECORD_BYTES = 128 << 20
"""No record, and no decompressed chunk, may be larger; whatever claims to be is damage."""
HEAD = struct.Struct("<BQ")
"""Opcode and length, before every record."""
STEP_BYTES = 4 << 20
KEPT_BYTES = 16 << 10
"""Longer schemas and channels are parsed each time."""
COMPRESSIONS = ("zstd", "lz4", "")


class UnreadableRecord(Exception):
    """A record whose bytes make no sense; readers catch it and report damage."""


class RawMessage(NamedTuple):
    """A message as it stands in the file, undecoded."""

    channel_id: int
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


@dataclass(frozen=True, slots=True)
class ChunkRecord:
    """A chunk, still compressed."""

    start_ns: int
    end_ns: int
    uncompressed_size: int
    uncompressed_crc: int
    compression: str
    packed: bytes | memoryview

    def unpack(self, *, limit: int = MAX_RECORD_BYTES) -> bytes:
        """Decompresses the records inside, checked against size and checksum.

        Raises:
            UnreadableRecord: wrong size or checksum, unknown compression, or more bytes than the limit.
        """
        if self.uncompressed_size > limit:
            raise UnreadableRecord(f"claims {self.uncompressed_size} bytes unpacked, beyond the limit of {limit}")
        data = unpacked(self.packed, self.compression, self.uncompressed_size)
        if len(data) != self.uncompressed_size:
            raise UnreadableRecord(f"does not unpack to the {self.uncompressed_size} bytes that it claims")
        if self.uncompressed_crc and zlib.crc32(data) != self.uncompressed_crc:
            raise UnreadableRecord("its checksum is wrong")
        return data

    def unpack_anyhow(self, *, limit: int = MAX_RECORD_BYTES) -> bytes:
        """As unpack, but tolerates a damaged size or compression name where the checksum proves the data.

        Raises:
            UnreadableRecord: no interpretation of it has the right checksum.
        """
        try:
            return self.unpack(limit=limit)
        except UnreadableRecord as error:
            for compression in COMPRESSIONS if self.uncompressed_crc else ():
                try:
                    data = unpacked(self.packed, compression, limit)
                except UnreadableRecord:
                    continue
                if zlib.crc32(data) == self.uncompressed_crc:
                    return data
            raise error


Record = McapRecord | ChunkRecord | RawMessage
Parser = Callable[[bytes], tuple[Record, int]]
"""Parses a record's bytes; returns the record and how many bytes it used."""


def parse(opcode: int, body: bytes) -> tuple[Record | None, bool]:
    """The record of an opcode, and whether it accounts for every byte; None for a kind that readers must skip.

    Raises:
        UnreadableRecord: the bytes are not such a record.
    """
    parser = _PARSERS.get(opcode)
    if parser is None:
        return None, False
    record, used = parser(body)
    return record, used == len(body)


def records_in(data: bytes, *, unwanted: Collection[int] = ()) -> Iterator[tuple[int, McapRecord | RawMessage]]:
    """The schemas, channels and messages of a decompressed chunk, with their offsets in it.

    Args:
        unwanted: ids of channels whose messages are skipped without copying; may grow during the iteration.

    Raises:
        UnreadableRecord: a record that reaches beyond the chunk or makes no sense.
    """
    offset, size = 0, len(data)
    unpack_head, unpack_message, message = HEAD.unpack_from, _MESSAGE.unpack_from, int(Opcode.MESSAGE)
    while offset < size:
        if offset + 9 > size:
            raise UnreadableRecord("it ends inside a record")
        opcode, length = unpack_head(data, offset)
        body = offset + 9
        end = body + length
        if end > size:
            raise UnreadableRecord("it holds a record that reaches beyond it")
        if opcode == message:
            if length < 22:
                raise UnreadableRecord("it holds a message that is too short")
            if data[body] | data[body + 1] << 8 in unwanted:
                offset = end
                continue
            yield offset, RawMessage._make((*unpack_message(data, body), data[body + 22 : end]))
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            record, _ = _PARSERS[opcode](data[body:end])
            if isinstance(record, Schema | Channel):
                yield offset, record
        offset = end


def walk_chunk(data: bytes) -> tuple[list[Schema | Channel], list[tuple[int, int, int, int]]]:
    """What a decompressed chunk declares, and its messages uncopied: channel id, log time, offsets of start and end.

    Raises:
        UnreadableRecord: a record that reaches beyond the chunk or makes no sense.
    """
    declared: list[Schema | Channel] = []
    places: list[tuple[int, int, int, int]] = []
    offset, size, message = 0, len(data), int(Opcode.MESSAGE)
    unpack_head = _HEAD_AND_MESSAGE.unpack_from
    while offset < size:
        opcode, length = HEAD.unpack_from(data, offset) if offset + HEAD.size <= size else (0, size)
        end = offset + HEAD.size + length
        if end > size:
            raise UnreadableRecord("it holds a record that reaches beyond it")
        if opcode == message:
            if length < _MESSAGE.size:
                raise UnreadableRecord("it holds a message that is too short")
            _, _, channel_id, _, log_time, _ = unpack_head(data, offset)
            places.append((channel_id, log_time, offset, end))
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            record, _ = _PARSERS[opcode](data[offset + HEAD.size : end])
            if isinstance(record, Schema | Channel):
                declared.append(record)
        offset = end
    return declared, places


def message_head(data: bytes, start: int) -> tuple[int, int, int]:
    """Sequence number and publish time of a message whose record begins at `start`, and where its data begin."""
    _, _, _, sequence, _, publish_time = _HEAD_AND_MESSAGE.unpack_from(data, start)
    return sequence, publish_time, start + _HEAD_AND_MESSAGE.size


def opcode_name(opcode: int) -> str:
    """The name of an opcode, such as "chunk index" for 8."""
    try:
        return Opcode(opcode).name.replace("_", " ").lower()
    except ValueError:
        return f"record {opcode:#x}"


def is_known(opcode: int) -> bool:
    return opcode in _PARSERS


def unpacked(packed: bytes | memoryview, compression: str, size: int) -> bytes:
    """Decompressed data; never more than size + 1 bytes are decompressed, whatever a frame claims."""
    if compression == "":
        return bytes(packed)
    try:
        if compression == "zstd":
            if 0 < size <= STEP_BYTES and zstandard.frame_content_size(packed) == size:
                with suppress(zstandard.ZstdError):  # one frame, in one step; anything else as a stream
                    return _zstd().decompress(packed, allow_extra_data=False)
            with _zstd().stream_reader(packed, read_across_frames=True) as stream:
                return _read_up_to(stream, size + 1)
        if compression == "lz4":
            return lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
    except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError) as error:
        raise UnreadableRecord(f"{compression}: {error}") from error
    raise UnreadableRecord(f"unknown compression {compression[:20]!r}")


def _zstd() -> zstandard.ZstdDecompressor:
    """One decompressor for each thread: creating it costs a third of decompressing a small chunk."""
    machine: zstandard.ZstdDecompressor | None = getattr(_OF_THREAD, "machine", None)
    if machine is None:
        machine = _OF_THREAD.machine = zstandard.ZstdDecompressor(max_window_size=1 << 27)
    return machine


def _read_up_to(stream: zstandard.ZstdDecompressionReader, size: int) -> bytes:
    """Reads in steps, so that memory follows what is there and not what is claimed."""
    parts: list[bytes] = []
    left = size
    while left > 0 and (part := stream.read(min(left, STEP_BYTES))):
        parts.append(part)
        left -= len(part)
    return parts[0] if len(parts) == 1 else b"".join(parts)


def _message(body: bytes) -> tuple[Record, int]:
    if len(body) < 22:
        raise UnreadableRecord("it is too short")
    return RawMessage._make((*_MESSAGE.unpack_from(body), body[22:])), len(body)


def _chunk(body: bytes) -> tuple[Record, int]:
    if len(body) < 40:
        raise UnreadableRecord("it is too short")
    start, end, size, crc, name_length = _CHUNK.unpack_from(body)
    data = 40 + name_length
    if data > len(body):
        raise UnreadableRecord("its compression's name reaches beyond it")
    (length,) = struct.unpack_from("<Q", body, data - 8)
    if data + length > len(body):
        raise UnreadableRecord("its data reach beyond it")
    try:
        compression = body[32 : data - 8].decode("utf-8")
    except UnicodeDecodeError:
        raise UnreadableRecord("its compression's name is not text") from None
    return ChunkRecord(start, end, size, crc, compression, memoryview(body)[data : data + length]), data + length


def _attachment(body: bytes) -> tuple[Record, int]:
    record, used = _checked_parser(Attachment)(body)
    if not isinstance(record, Attachment):
        raise UnreadableRecord("it is not an attachment")
    (crc,) = struct.unpack_from("<L", body, used - 4)
    if crc and zlib.crc32(memoryview(body)[: used - 4]) != crc:
        raise UnreadableRecord(f"the checksum of attachment {record.name[:60]!r} is wrong")
    return record, used


def _metadata(body: bytes) -> tuple[Record, int]:
    """MCAP has no checksum for metadata; our own records carry one, and a wrong one is damage as in a chunk."""
    record, used = _checked_parser(Metadata)(body)
    own = _OWN_METADATA.fullmatch(record.name) if isinstance(record, Metadata) else None
    if isinstance(record, Metadata) and own and not is_intact(own[1], record.metadata):
        raise UnreadableRecord(f"the checksum of {record.name[:60]!r} is wrong")
    return record, used


class _Kind(Protocol):
    """A record class of mcap's record layer, with its own `read`."""

    @staticmethod
    def read(stream: ReadDataStream) -> McapRecord: ...


def _checked_parser(cls: type[_Kind]) -> Parser:
    """A parser by mcap's record layer that refuses records which claim more than they hold."""

    def parser(body: bytes) -> tuple[Record, int]:
        stream = _StrictStream(io.BytesIO(body))
        try:
            return cls.read(stream), stream.count
        except (McapError, struct.error, ValueError, OverflowError) as error:
            raise UnreadableRecord(str(error) or "it ends too early") from error

    return parser


def _cached_parser(cls: type[Schema | Channel]) -> Parser:
    """A parser of records that occur in every log, and in most chunks once more: equal bytes are parsed once.

    Callers must not modify the records. At most 512 of up to 16 kB are cached.
    """
    parser = _checked_parser(cls)
    kept = lru_cache(maxsize=512)(parser)
    return lambda body: kept(body) if len(body) <= KEPT_BYTES else parser(body)


def _chunk_index(body: bytes) -> tuple[Record, int]:
    """Parsed with one struct: there is at least one a second, and mcap's reading of single numbers would dominate
    opening."""
    if len(body) < _INDEX_HEAD.size:
        raise UnreadableRecord("it is too short")
    start, end, at, length, offsets_bytes = _INDEX_HEAD.unpack_from(body)
    rest = _INDEX_HEAD.size + offsets_bytes
    name = rest + 12
    if offsets_bytes % 10 or name > len(body):
        raise UnreadableRecord("it claims more than it holds")
    index_length, name_length = struct.unpack_from("<QL", body, rest)
    used = name + name_length + 16
    if used > len(body):
        raise UnreadableRecord("it claims more than it holds")
    packed, unpacked = struct.unpack_from("<QQ", body, used - 16)
    try:
        compression = body[name : used - 16].decode("utf-8")
    except UnicodeDecodeError:
        raise UnreadableRecord("its compression's name is not text") from None
    record = ChunkIndex(
        chunk_length=length,
        chunk_start_offset=at,
        compression=compression,
        compressed_size=packed,
        message_end_time=end,
        message_index_length=index_length,
        message_index_offsets=dict(struct.iter_unpack("<HQ", body[_INDEX_HEAD.size : rest])),
        message_start_time=start,
        uncompressed_size=unpacked,
    )
    return record, used


def _message_index(body: bytes) -> tuple[Record, int]:
    if len(body) < 6:
        raise UnreadableRecord("it is too short")
    channel_id, length = struct.unpack_from("<HL", body)
    if length % 16 or 6 + length > len(body):
        raise UnreadableRecord("it claims more than it holds")
    entries = list(struct.iter_unpack("<QQ", body[6 : 6 + length]))
    return MessageIndex(channel_id=channel_id, records=entries), 6 + length


class _StrictStream(ReadDataStream):
    """mcap's stream, but a short read raises instead of passing silently."""

    def read(self, length: int) -> bytes:
        data = super().read(length)
        if len(data) != length:
            raise UnreadableRecord("it claims more than it holds")
        return data


_OF_THREAD = threading.local()
_OWN_METADATA = re.compile(r"(?:runs/\d{1,6}/)?(lios\..+)", re.DOTALL)
_MESSAGE = struct.Struct("<HIQQ")
_HEAD_AND_MESSAGE = struct.Struct("<BQHIQQ")
_CHUNK = struct.Struct("<QQQLL")
_INDEX_HEAD = struct.Struct("<QQQQL")
_PARSERS: Mapping[int, Parser] = MappingProxyType(
    {
        Opcode.HEADER: _checked_parser(Header),
        Opcode.FOOTER: _checked_parser(Footer),
        Opcode.SCHEMA: _cached_parser(Schema),
        Opcode.CHANNEL: _cached_parser(Channel),
        Opcode.MESSAGE: _message,
        Opcode.CHUNK: _chunk,
        Opcode.MESSAGE_INDEX: _message_index,
        Opcode.CHUNK_INDEX: _chunk_index,
        Opcode.ATTACHMENT: _attachment,
        Opcode.ATTACHMENT_INDEX: _checked_parser(AttachmentIndex),
        Opcode.STATISTICS: _checked_parser(Statistics),
        Opcode.METADATA: _metadata,
        Opcode.METADATA_INDEX: _checked_parser(MetadataIndex),
        Opcode.SUMMARY_OFFSET: _checked_parser(SummaryOffset),
        Opcode.DATA_END: _checked_parser(DataEnd),
    }
)
