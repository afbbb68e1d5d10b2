"""Every layout of an MCAP file that the specification allows, written record by record."""

from __future__ import annotations

import itertools
import struct
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, fields

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
    Header,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """Which optional parts a file has, and where its attachments and metadata stand."""

    chunked: bool = True
    message_index: bool = True
    chunk_index: bool = True
    statistics: bool = True
    repeated_schemas: bool = True
    repeated_channels: bool = True
    summary_offsets: bool = True
    other_indexes: bool = True
    around: str = "before"
    """Where attachments and metadata stand: before, between or after the messages."""


def all_layouts() -> Iterator[Layout]:
    """All combinations, without those of a message or chunk index and no chunks."""
    names = [f.name for f in fields(Layout) if f.name != "around"]
    for around in ("before", "between", "after"):
        for values in itertools.product((True, False), repeat=len(names)):
            layout = Layout(**dict(zip(names, values, strict=True)), around=around)
            if layout.chunked or not (layout.message_index or layout.chunk_index):
                yield layout


@dataclass(slots=True)
class Contents:
    """What a file holds."""

    schemas: list[Schema] = field(default_factory=list)
    channels: list[Channel] = field(default_factory=list)
    messages: list[Message] = field(default_factory=list)
    others: list[Attachment | Metadata] = field(default_factory=list)


def raw(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def file_of(contents: Contents, layout: Layout, *, chunk_messages: int = 3) -> bytes:
    """The bytes of a closed file."""
    return _FileWriter(contents, layout, chunk_messages).whole()


class _FileWriter:
    def __init__(self, contents: Contents, layout: Layout, chunk_messages: int) -> None:
        self.contents, self.layout, self.chunk_messages = contents, layout, chunk_messages
        self.data = bytearray(MAGIC + raw(Header(profile="", library="by hand")))
        self.chunks: list[ChunkIndex] = []
        self.others: list[AttachmentIndex | MetadataIndex] = []
        self.declared: set[int] = set()

    def whole(self) -> bytes:
        messages, around = self.contents.messages, self.layout.around
        batches = [messages[i : i + self.chunk_messages] for i in range(0, len(messages), self.chunk_messages)]
        for number, batch in enumerate(batches):
            if (around == "before" and number == 0) or (around == "between" and number == 1):
                self._write_others()
            if self.layout.chunked:
                self._write_chunk(batch)
            else:
                self.data += b"".join(raw(record) for record in self._with_declarations(batch))
        if around == "after" or (around == "between" and len(batches) < 2):
            self._write_others()
        self.data += raw(DataEnd(data_section_crc=0))
        return bytes(self.data) + self._summary(len(self.data))

    def _with_declarations(self, batch: Iterable[Message]) -> Iterator[McapRecord]:
        for message in batch:
            if message.channel_id not in self.declared:
                self.declared.add(message.channel_id)
                channel = next(c for c in self.contents.channels if c.id == message.channel_id)
                yield from (s for s in self.contents.schemas if s.id == channel.schema_id)
                yield channel
            yield message

    def _write_chunk(self, batch: list[Message]) -> None:
        body, entries = bytearray(), dict[int, list[tuple[int, int]]]()
        for record in self._with_declarations(batch):
            if isinstance(record, Message):
                entries.setdefault(record.channel_id, []).append((record.log_time, len(body)))
            body += raw(record)
        times = [message.log_time for message in batch]
        chunk = Chunk(
            compression="",
            data=bytes(body),
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(body),
            uncompressed_size=len(body),
        )
        start, offsets = len(self.data), dict[int, int]()
        self.data += raw(chunk)
        length = len(self.data) - start
        for channel, records in entries.items() if self.layout.message_index else ():
            offsets[channel] = len(self.data)
            self.data += raw(MessageIndex(channel_id=channel, records=records))
        self.chunks.append(
            ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression="",
                compressed_size=len(body),
                message_end_time=max(times),
                message_index_length=len(self.data) - start - length,
                message_index_offsets=offsets,
                message_start_time=min(times),
                uncompressed_size=len(body),
            )
        )

    def _write_others(self) -> None:
        for record in self.contents.others:
            data, offset = raw(record), len(self.data)
            self.data += data
            if isinstance(record, Metadata):
                self.others.append(MetadataIndex(offset=offset, length=len(data), name=record.name))
            else:
                self.others.append(
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

    def _summary(self, start: int) -> bytes:
        layout, contents = self.layout, self.contents
        groups: list[tuple[Opcode, bool, list[McapRecord]]] = [
            (Opcode.SCHEMA, layout.repeated_schemas, [*contents.schemas]),
            (Opcode.CHANNEL, layout.repeated_channels, [*contents.channels]),
            (Opcode.STATISTICS, layout.statistics, [self._statistics()]),
            (Opcode.CHUNK_INDEX, layout.chunk_index, [*self.chunks]),
            (Opcode.ATTACHMENT_INDEX, layout.other_indexes, [o for o in self.others if not _is_metadata(o)]),
            (Opcode.METADATA_INDEX, layout.other_indexes, [o for o in self.others if _is_metadata(o)]),
        ]
        body, offsets = bytearray(), bytearray()
        for opcode, wanted, records in groups:
            at = len(body)
            body += b"".join(raw(record) for record in records) if wanted else b""
            if layout.summary_offsets and len(body) > at:
                offsets += raw(
                    SummaryOffset(group_opcode=opcode, group_start=start + at, group_length=len(body) - at)
                )
        offset_start = start + len(body) if offsets else 0
        body += offsets
        summary_start = start if body else 0
        crc = zlib.crc32(bytes(body) + struct.pack("<BQQQ", Opcode.FOOTER, 20, summary_start, offset_start))
        return bytes(body) + raw(Footer(summary_start, offset_start, crc)) + MAGIC

    def _statistics(self) -> Statistics:
        messages = self.contents.messages
        counts: dict[int, int] = {}
        for message in messages:
            counts[message.channel_id] = counts.get(message.channel_id, 0) + 1
        metadata = sum(isinstance(other, Metadata) for other in self.contents.others)
        return Statistics(
            attachment_count=len(self.contents.others) - metadata,
            channel_count=len(self.contents.channels),
            channel_message_counts=counts,
            chunk_count=len(self.chunks),
            message_count=len(messages),
            message_end_time=max(m.log_time for m in messages),
            message_start_time=min(m.log_time for m in messages),
            metadata_count=metadata,
            schema_count=len(self.contents.schemas),
        )


def _is_metadata(index: object) -> bool:
    return isinstance(index, MetadataIndex)
