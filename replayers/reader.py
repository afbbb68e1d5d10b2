"""What stands in a log? The one file that reads MCAP.

Every length that a file claims is checked against what is there before anything is allocated, so that no damaged
file can take more memory than MAX_RECORD_BYTES for a record and its contents. Two ways in: `scan` walks a file from
its start, record by record, and can be told to go on after damage; `read_summary` reads the index at its end.
"""

from __future__ import annotations

import io
import os
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, NamedTuple

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

from workbench.errors import FileMissing, Malformed, MalformedFile

MAGIC = b"\x89MCAP0\r\n"
MAX_RECORD_BYTES = 128 << 20
"""No record, and no chunk unpacked, may be larger. Attachments are read apart and may."""
RECORD_HEAD = 9
FOOTER_BYTES = RECORD_HEAD + 20


class NoMcap(MalformedFile):
    """A file that is not MCAP."""

    def __init__(self, path: Path | str, size: int) -> None:
        what = "it is empty" if size == 0 else "it is no MCAP file"
        super().__init__(path, what, "Give a log that lios recorded, or convert it: lios import")


class DamagedLog(Malformed):
    """A log that cannot be read to its end."""

    def __init__(self, path: Path | str, offset: int, what: str) -> None:
        super().__init__(f"{path}: damaged at byte {offset} ({what}). Save the rest: lios recover {path}")


class Damage(NamedTuple):
    """One place at which a file is not what it should be.

    Attributes:
        offset: of the record.
        what: in words.
        messages_lost: None when nobody can know.
    """

    offset: int
    what: str
    messages_lost: int | None = None


class Raw(NamedTuple):
    """A message as it stands in the file."""

    channel_id: int
    sequence: int
    log_time: int
    publish_time: int
    data: bytes


@dataclass(frozen=True, slots=True, kw_only=True)
class RawMessage:
    """A message with its channel and schema, undecoded."""

    topic: str
    channel: Channel
    schema: Schema | None
    log_time: int
    publish_time: int
    sequence: int
    data: bytes


@dataclass(frozen=True, slots=True)
class ChunkRecord:
    """A chunk, still packed."""

    start_ns: int
    end_ns: int
    uncompressed_size: int
    uncompressed_crc: int
    compression: str
    packed: bytes


Record = McapRecord | ChunkRecord | Raw
OnDamage = Callable[[Damage], None]


class Unreadable(Exception):
    """A record whose bytes make no sense; caught inside this file and by those who count damage."""


@dataclass(slots=True)
class Summary:
    """What the end of a file says is in it."""

    header: Header | None = None
    statistics: Statistics | None = None
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    data_end: int = 0
    """Offset of the DataEnd record: where more could be appended."""
    data_crc: int = 0


def open_log(path: Path | str) -> BinaryIO:
    """A log opened for reading.

    Raises:
        FileMissing, NoMcap: there is none, or it is no MCAP file.
    """
    path = Path(path)
    try:
        stream = open(path, "rb")  # noqa: SIM115
    except (FileNotFoundError, NotADirectoryError):
        raise FileMissing(path) from None
    except IsADirectoryError:
        raise MalformedFile(path, "it is a folder", "Give one log, or lios list for a folder") from None
    except OSError as error:
        raise MalformedFile(path, f"it cannot be opened ({error.strerror})", "Check its permissions") from None
    if stream.read(len(MAGIC)) != MAGIC:
        size = os.fstat(stream.fileno()).st_size
        stream.close()
        raise NoMcap(path, size)
    stream.seek(0)
    return stream


def scan(
    stream: BinaryIO, *, on_damage: OnDamage | None = None, path: Path | str = "", start: int = len(MAGIC)
) -> Iterator[tuple[int, Record]]:
    """Every record from the start of the file to its footer, with its offset; chunks packed, messages raw.

    Args:
        on_damage: told of every damage, and the walk goes on where it can; without it, damage raises.
        start: where to begin; after the magic by default.

    Raises:
        DamagedLog: damage, when on_damage is not given.
    """
    size = _size(stream)
    offset = start

    def damaged(what: str) -> None:
        if on_damage is None:
            raise DamagedLog(path, offset, what)
        on_damage(Damage(offset, what))

    while True:
        stream.seek(offset)
        head = stream.read(RECORD_HEAD)
        if len(head) < RECORD_HEAD:
            damaged("the file ends without a footer" if not head else "the file ends inside a record")
            return
        opcode, length = _HEAD.unpack(head)
        end = offset + RECORD_HEAD + length
        if opcode == 0 or end > size:
            damaged(
                f"a record claims {length} bytes, {size - offset - RECORD_HEAD} are left" if opcode else "a zero byte"
            )
            return
        if length > MAX_RECORD_BYTES and opcode != Opcode.ATTACHMENT:
            damaged(f"a record of {length} bytes is beyond the limit of {MAX_RECORD_BYTES}")
        elif opcode in _PARSERS:
            try:
                record = _PARSERS[opcode](stream.read(length))
            except Unreadable as error:
                damaged(f"{_name(opcode)}: {error}")
            else:
                yield offset, record
        if opcode == Opcode.FOOTER:
            return
        offset = end


def unpack(chunk: ChunkRecord, *, limit: int = MAX_RECORD_BYTES) -> bytes:
    """A chunk's records, checked against its size and checksum.

    Raises:
        Unreadable: another size or checksum, an unknown compression, or more than the limit.
    """
    if chunk.uncompressed_size > limit:
        raise Unreadable(f"claims {chunk.uncompressed_size} bytes unpacked, beyond the limit of {limit}")
    if chunk.compression == "":
        data = chunk.packed
    elif chunk.compression == "zstd":
        data = _unpack_zstd(chunk.packed, chunk.uncompressed_size)
    elif chunk.compression == "lz4":
        data = _unpack_lz4(chunk.packed, chunk.uncompressed_size)
    else:
        raise Unreadable(f"unknown compression {chunk.compression[:20]!r}")
    if len(data) != chunk.uncompressed_size:
        raise Unreadable(f"unpacks to {len(data)} bytes instead of {chunk.uncompressed_size}")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise Unreadable("its checksum is wrong")
    return data


def records_in(data: bytes) -> Iterator[tuple[int, McapRecord | Raw]]:
    """The schemas, channels and messages of an unpacked chunk, with their offsets in it.

    Raises:
        Unreadable: a record that reaches beyond the chunk or makes no sense.
    """
    offset, size = 0, len(data)
    while offset < size:
        if offset + RECORD_HEAD > size:
            raise Unreadable("ends inside a record")
        opcode, length = _HEAD.unpack_from(data, offset)
        body, end = offset + RECORD_HEAD, offset + RECORD_HEAD + length
        if end > size:
            raise Unreadable("holds a record that reaches beyond it")
        if opcode == Opcode.MESSAGE:
            if length < 22:
                raise Unreadable("holds a message that is too short")
            channel_id, sequence, log_time, publish_time = _MESSAGE.unpack_from(data, body)
            yield offset, Raw(channel_id, sequence, log_time, publish_time, data[body + 22 : end])
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            yield offset, _PARSERS[opcode](data[body:end])  # type: ignore[misc]
        offset = end


def read_summary(stream: BinaryIO) -> Summary | None:
    """The summary at the end of a file; None when the file was not closed or its summary is damaged."""
    size = _size(stream)
    tail = FOOTER_BYTES + len(MAGIC)
    if size < len(MAGIC) + tail:
        return None
    stream.seek(size - tail)
    end = stream.read(tail)
    if end[-len(MAGIC) :] != MAGIC or end[0] != Opcode.FOOTER:
        return None
    start, _, crc = struct.unpack_from("<QQL", end, RECORD_HEAD)
    length = size - tail - start
    if start < len(MAGIC) or length < 0 or length > MAX_RECORD_BYTES:
        return None
    stream.seek(start)
    body = stream.read(length)
    if crc and zlib.crc32(body + end[: RECORD_HEAD + 16]) != crc:
        return None
    summary = Summary()
    try:
        _fill(summary, body)
        stream.seek(len(MAGIC))
        summary.header = next((r for _, r in scan(stream) if isinstance(r, Header)), None)
    except (Unreadable, DamagedLog):
        return None
    summary.data_end = start - RECORD_HEAD - 4
    stream.seek(summary.data_end)
    data_end = stream.read(RECORD_HEAD + 4)
    if data_end[:1] == bytes([Opcode.DATA_END]):
        summary.data_crc = int.from_bytes(data_end[RECORD_HEAD:], "little")
    return summary


def record_at(stream: BinaryIO, offset: int, *, path: Path | str = "") -> Record:
    """The one record at an offset.

    Raises:
        DamagedLog: there is none, or it makes no sense.
    """
    for _, record in scan(stream, path=path, start=offset):
        return record
    raise DamagedLog(path, offset, "no record where the index says")


def messages(
    path: Path | str,
    *,
    topics: Callable[[str], bool] | None = None,
    start_ns: int = 0,
    end_ns: int | None = None,
    on_damage: OnDamage | None = None,
) -> Iterator[RawMessage]:
    """Messages in the order of the file, undecoded, with channel and schema; streaming, one chunk in memory.

    A file that was not closed, or is cut off, gives all that is intact before the end.

    Args:
        topics: which topics are wanted; all if not given.
        start_ns, end_ns: log times, end exclusive.
        on_damage: told of damage, and reading goes on; without it, damage ends the reading in silence only where a
            recorder died, and raises elsewhere.
    """
    with open_log(path) as stream:
        yield from _messages(stream, Path(path), topics, start_ns, end_ns, on_damage)


def _messages(
    stream: BinaryIO,
    path: Path,
    topics: Callable[[str], bool] | None,
    start_ns: int,
    end_ns: int | None,
    on_damage: OnDamage | None,
) -> Iterator[RawMessage]:
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    wanted: dict[int, bool] = {}
    report = on_damage or (lambda damage: None)
    end = end_ns if end_ns is not None else 1 << 64
    for offset, record in scan(stream, on_damage=report, path=path):
        if isinstance(record, ChunkRecord):
            if record.end_ns < start_ns or record.start_ns >= end:
                records: Iterator[tuple[int, McapRecord | Raw]] = _declarations(record)
            else:
                try:
                    records = records_in(unpack(record))
                except Unreadable as error:
                    report(Damage(offset, f"Chunk: {error}"))
                    continue
        elif isinstance(record, DataEnd):
            return
        else:
            records = iter(((offset, record),))
        try:
            for _, inner in records:
                if isinstance(inner, Raw):
                    channel = channels.get(inner.channel_id)
                    if channel is None:
                        report(
                            Damage(offset, f"a message of channel {inner.channel_id}, which is declared nowhere", 1)
                        )
                        continue
                    if not (start_ns <= inner.log_time < end):
                        continue
                    if topics is not None:
                        if inner.channel_id not in wanted:
                            wanted[inner.channel_id] = topics(channel.topic)
                        if not wanted[inner.channel_id]:
                            continue
                    yield RawMessage(
                        topic=channel.topic,
                        channel=channel,
                        schema=schemas.get(channel.schema_id),
                        log_time=inner.log_time,
                        publish_time=inner.publish_time,
                        sequence=inner.sequence,
                        data=inner.data,
                    )
                elif isinstance(inner, Schema):
                    schemas[inner.id] = inner
                elif isinstance(inner, Channel):
                    channels[inner.id] = inner
        except Unreadable as error:
            report(Damage(offset, f"Chunk: {error}"))


def _declarations(chunk: ChunkRecord) -> Iterator[tuple[int, McapRecord | Raw]]:
    try:
        for offset, record in records_in(unpack(chunk)):
            if not isinstance(record, Raw):
                yield offset, record
    except Unreadable:
        return


def _fill(summary: Summary, body: bytes) -> None:
    offset = 0
    places: Mapping[type, Callable[[McapRecord], None]] = {
        Schema: lambda r: summary.schemas.__setitem__(r.id, r),  # type: ignore[attr-defined]
        Channel: lambda r: summary.channels.__setitem__(r.id, r),  # type: ignore[attr-defined]
        Statistics: lambda r: setattr(summary, "statistics", r),
        ChunkIndex: lambda r: summary.chunks.append(r),  # type: ignore[arg-type]
        AttachmentIndex: lambda r: summary.attachments.append(r),  # type: ignore[arg-type]
        MetadataIndex: lambda r: summary.metadata.append(r),  # type: ignore[arg-type]
    }
    while offset + RECORD_HEAD <= len(body):
        opcode, length = _HEAD.unpack_from(body, offset)
        start = offset + RECORD_HEAD
        if start + length > len(body):
            raise Unreadable("summary ends inside a record")
        if opcode in _PARSERS:
            record = _PARSERS[opcode](body[start : start + length])
            if type(record) in places:
                places[type(record)](record)  # type: ignore[arg-type]
        offset = start + length


def _unpack_zstd(packed: bytes, size: int) -> bytes:
    """At most size + 1 bytes are ever unpacked, whatever the frame claims."""
    try:
        with zstandard.ZstdDecompressor(max_window_size=1 << 27).stream_reader(
            packed, read_across_frames=True
        ) as out:
            data = out.read(size + 1)
    except (zstandard.ZstdError, MemoryError) as error:
        raise Unreadable(f"zstd: {error}") from error
    return data


def _unpack_lz4(packed: bytes, size: int) -> bytes:
    try:
        return lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
    except (RuntimeError, MemoryError, EOFError) as error:
        raise Unreadable(f"lz4: {error}") from error


def _size(stream: BinaryIO) -> int:
    return stream.seek(0, io.SEEK_END)


def _name(opcode: int) -> str:
    try:
        return Opcode(opcode).name.replace("_", " ").lower()
    except ValueError:
        return f"record {opcode:#x}"


def _parse_chunk(body: bytes) -> ChunkRecord:
    if len(body) < 40:
        raise Unreadable("too short")
    start, end, size, crc, name_length = struct.unpack_from("<QQQLL", body)
    if 32 + name_length + 8 > len(body):
        raise Unreadable("its compression's name reaches beyond it")
    (length,) = struct.unpack_from("<Q", body, 32 + name_length)
    data = 40 + name_length
    if data + length > len(body):
        raise Unreadable("its data reach beyond it")
    try:
        compression = body[32 : 32 + name_length].decode("utf-8")
    except UnicodeDecodeError:
        raise Unreadable("its compression's name is no text") from None
    return ChunkRecord(start, end, size, crc, compression, body[data : data + length])


def _parse_message(body: bytes) -> Raw:
    if len(body) < 22:
        raise Unreadable("too short")
    return Raw(*_MESSAGE.unpack_from(body), body[22:])


def _parse_attachment(body: bytes) -> Attachment:
    attachment = _small(Attachment)(body)
    assert isinstance(attachment, Attachment)
    (crc,) = struct.unpack_from("<L", body, len(body) - 4)
    if crc and zlib.crc32(body[:-4]) != crc:
        raise Unreadable(f"the checksum of attachment {attachment.name!r} is wrong")
    return attachment


def _small(cls: type[McapRecord]) -> Callable[[bytes], McapRecord]:
    """A parser by mcap's record layer that refuses records which claim more than they hold."""

    def parse(body: bytes) -> McapRecord:
        stream = _Strict(io.BytesIO(body))
        try:
            return cls.read(stream)  # type: ignore[attr-defined, no-any-return]
        except (McapError, struct.error, ValueError, MemoryError, OverflowError) as error:
            raise Unreadable(str(error) or type(error).__name__) from error

    return parse


class _Strict(ReadDataStream):
    """mcap's stream, without its silence about short reads."""

    def read(self, length: int) -> bytes:
        data = super().read(length)
        if len(data) != length:
            raise Unreadable("it claims more than it holds")
        return data


_HEAD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_PARSERS: dict[int, Callable[[bytes], Record]] = {
    Opcode.HEADER: _small(Header),
    Opcode.FOOTER: _small(Footer),
    Opcode.SCHEMA: _small(Schema),
    Opcode.CHANNEL: _small(Channel),
    Opcode.MESSAGE: _parse_message,
    Opcode.CHUNK: _parse_chunk,
    Opcode.MESSAGE_INDEX: _small(MessageIndex),
    Opcode.CHUNK_INDEX: _small(ChunkIndex),
    Opcode.ATTACHMENT: _parse_attachment,
    Opcode.ATTACHMENT_INDEX: _small(AttachmentIndex),
    Opcode.STATISTICS: _small(Statistics),
    Opcode.METADATA: _small(Metadata),
    Opcode.METADATA_INDEX: _small(MetadataIndex),
    Opcode.SUMMARY_OFFSET: _small(SummaryOffset),
    Opcode.DATA_END: _small(DataEnd),
}
