"""The index of a log (its summary section), kept while writing and rebuilt when reading."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Footer,
    Header,
    McapRecord,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"


@dataclass(slots=True)
class LogIndex:
    """The contents of a summary section.

    Attributes:
        counts: messages per channel id.
        first_ns, last_ns: first and last log time in nanoseconds; 0 without messages.
        data_end: offset of the DataEnd record, where appending starts.
        data_crc: checksum of all bytes before it; 0 if not computed.
    """

    header: Header | None = None
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)
    first_ns: int = 0
    last_ns: int = 0
    statistics: Statistics | None = None
    data_end: int = 0
    data_crc: int = 0

    @property
    def messages(self) -> int:
        return sum(self.counts.values())

    def count(self, channel_id: int, log_time: int) -> int:
        """Count a message; returns the previous count of its channel."""
        if self.counts:
            self.first_ns, self.last_ns = min(self.first_ns, log_time), max(self.last_ns, log_time)
        else:
            self.first_ns = self.last_ns = log_time
        before = self.counts.get(channel_id, 0)
        self.counts[channel_id] = before + 1
        return before

    def count_all(self, channel_id: int, stamps: Sequence[tuple[int, int]]) -> None:
        """Count messages of one channel, given by log time and anything else."""
        first, last = min(stamps)[0], max(stamps)[0]
        self.count(channel_id, first)
        self.last_ns = max(self.last_ns, last)
        self.counts[channel_id] += len(stamps) - 1

    def learn(self, record: object) -> None:
        """Register a schema or channel; other records are ignored."""
        if isinstance(record, Schema):
            self.schemas[record.id] = record
        elif isinstance(record, Channel):
            self.channels[record.id] = record

    def to_bytes(self, start: int) -> bytes:
        """Summary, footer and closing magic of a file whose data end at offset `start`."""
        statistics = Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=dict(sorted(self.counts.items())),
            chunk_count=len(self.chunks),
            message_count=self.messages,
            message_end_time=self.last_ns,
            message_start_time=self.first_ns,
            metadata_count=len(self.metadata),
            schema_count=len(self.schemas),
        )
        groups: list[tuple[Opcode, list[McapRecord]]] = [
            (Opcode.SCHEMA, [*self.schemas.values()]),
            (Opcode.CHANNEL, [*self.channels.values()]),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, [*self.chunks]),
            (Opcode.ATTACHMENT_INDEX, [*self.attachments]),
            (Opcode.METADATA_INDEX, [*self.metadata]),
        ]
        body, offsets = bytearray(), bytearray()
        for opcode, records in groups:
            at = len(body)
            for record in records:
                body += record_bytes(record)
            if records:
                group = SummaryOffset(group_opcode=opcode, group_start=start + at, group_length=len(body) - at)
                offsets += record_bytes(group)
        offset_start = start + len(body)
        body += offsets
        crc = zlib.crc32(bytes(body) + struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offset_start))
        footer = Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=crc)
        return bytes(body) + record_bytes(footer) + MAGIC


def record_bytes(record: McapRecord) -> bytes:
    """One record as mcap's record layer writes it."""
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()
