"""Checks an MCAP file itself: magic, lengths, checksums, indexes and order, in one streaming pass.

Memory: one record, and a few numbers for each chunk. Checks follow the MCAP specification: a fault in what a reader
can do without (an index) is at most a loss, a fault that it would misread (a wrong checksum) is an error.
"""

from __future__ import annotations

import io
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.records import Attachment, Channel, DataEnd, Footer, Header, MessageIndex, Metadata, Schema

from recorders.mcap_io.index import MAGIC, LogIndex
from replayers.doctor.findings import Findings, Level
from replayers.mcap_io.messages import Message
from replayers.mcap_io.records import HEAD, ChunkRecord, RawMessage, Record, UnreadableRecord, records_in
from replayers.mcap_io.scan import Damage, scan
from replayers.mcap_io.summary import FOOTER_BYTES, read_summary

DATA_END_BYTES = 4
Report = Callable[[str], None]
PROFILES = ("", "ros1", "ros2")
RECOVER = "Save what is intact: lios recover"
INDEX_CUT = "the file was cut off in its index; no message, attachment or metadata is lost"
REBUILD = "Give it an index again: lios recover"
REWRITE = "Readers walk the whole file; with an index it opens faster: lios log compact"


@dataclass(slots=True)
class ContainerScan:
    """State of the pass through a file.

    Attributes:
        chunk_spans_ns: longest log time between first and last message of a chunk.
        cut_off: the file ends before its data do.
        index_cut: it ends after them, inside its index.
        has_end: it ends with the closing magic.
    """

    findings: Findings
    channels: dict[int, Channel] = field(default_factory=dict)
    schemas: dict[int, Schema] = field(default_factory=dict)
    counts: dict[int, int] = field(default_factory=dict)
    chunks: dict[int, tuple[int, int, int]] = field(default_factory=dict)
    attachments: dict[int, str] = field(default_factory=dict)
    metadata: dict[int, str] = field(default_factory=dict)
    chunk_span_ns: int = 0
    newest_ns: int = 0
    late_ns: int = 0
    late: int = 0
    first: bool = True
    data_end: tuple[int, int] | None = None
    footer: Footer | None = None
    footer_end: int = 0
    cut_off: bool = False
    index_cut: bool = False
    has_end: bool = False
    damaged: bool = False
    indexes_of: tuple[int, dict[int, list[tuple[int, int]]]] | None = None

    def damage(self, damage: Damage) -> None:
        where = f"byte {damage.offset}"
        if damage.cut_off and self.data_end is not None and not self.has_end:
            self.index_cut = True
            self.findings.warning(where, f"{damage.what}: {INDEX_CUT}", REBUILD, kind="index cut off")
            return
        self.damaged = True
        if damage.cut_off:
            self.cut_off = True
            self.findings.add(Level.LOSS, where, damage.what, RECOVER, kind="cut off")
        elif damage.loses_content:
            self.findings.error(where, damage.what, RECOVER)
        else:
            self.findings.error(where, damage.what, RECOVER, kind="bookkeeping")


def walk_container(path: Path, stream: BinaryIO, walk: ContainerScan) -> Iterator[Message | Attachment | Metadata]:
    """Yields all content of a file; what is wrong with the file is added to the findings of the walk.

    The summary is compared when the iterator ends.
    """
    stream.seek(-len(MAGIC), io.SEEK_END)
    walk.has_end = stream.read() == MAGIC
    for offset, record in scan(stream, path=path, on_damage=walk.damage):
        if walk.first:
            walk.first = False
            if not isinstance(record, Header):
                walk.findings.error(f"byte {offset}", "the first record is no header", RECOVER)
        yield from _take(walk, offset, record)
    _check_end(walk, stream)


def _take(walk: ContainerScan, offset: int, record: Record) -> Iterator[Message | Attachment | Metadata]:
    findings = walk.findings
    if walk.data_end is not None and not isinstance(record, Footer):
        return  # the summary is compared as a whole
    if walk.indexes_of is not None and isinstance(record, ChunkRecord | RawMessage | DataEnd):
        _check_indexes_complete(walk)
    match record:
        case Header():
            if record.profile not in PROFILES:
                findings.warning("header", f"profile {record.profile[:40]!r} is none that tools know")
        case ChunkRecord():
            yield from _chunk(walk, offset, record)
        case RawMessage():
            yield from _message(walk, offset, record)
        case Schema() | Channel():
            _declare(walk, offset, record)
        case MessageIndex():
            _check_index(walk, offset, record)
        case Attachment():
            walk.attachments[offset] = record.name
            yield record
        case Metadata():
            walk.metadata[offset] = record.name
            yield record
        case DataEnd():
            walk.data_end = (offset, record.data_section_crc)
        case Footer():
            walk.footer, walk.footer_end = record, offset + FOOTER_BYTES
        case _:
            pass


def _chunk(walk: ContainerScan, offset: int, chunk: ChunkRecord) -> Iterator[Message]:
    where = f"chunk at byte {offset}"
    try:
        data = chunk.unpack()
    except UnreadableRecord as error:
        walk.damaged = True
        walk.findings.error(where, str(error), RECOVER, kind="chunk")
        try:
            data = chunk.unpack_anyhow()
        except UnreadableRecord:
            return
    if not chunk.uncompressed_crc:
        walk.findings.add(Level.INFO, where, "it has no checksum", kind="no checksum")
    index: dict[int, list[tuple[int, int]]] = {}
    stamps: list[int] = []
    try:
        for at, inner in records_in(data):
            if isinstance(inner, RawMessage):
                index.setdefault(inner.channel_id, []).append((inner.log_time, at))
                stamps.append(inner.log_time)
                yield from _message(walk, offset, inner)
            elif isinstance(inner, Schema | Channel):
                _declare(walk, offset, inner)
    except UnreadableRecord as error:
        walk.damaged = True
        walk.findings.error(where, str(error), RECOVER, kind="chunk")
    first, last = (min(stamps), max(stamps)) if stamps else (0, 0)
    if stamps and (chunk.start_ns, chunk.end_ns) != (first, last):
        walk.findings.error(where, "its times are not those of its messages", RECOVER, kind="chunk times")
    walk.chunk_span_ns = max(walk.chunk_span_ns, last - first)
    walk.chunks[offset] = (first, last, len(stamps))
    walk.indexes_of = (offset, index)


def _message(walk: ContainerScan, offset: int, raw: RawMessage) -> Iterator[Message]:
    channel = walk.channels.get(raw.channel_id)
    if channel is None:
        what = f"a message of channel {raw.channel_id}, which is declared nowhere before"
        walk.findings.error(f"byte {offset}", what, RECOVER, kind="undeclared channel")
        walk.damaged = True
        return
    walk.counts[channel.id] = walk.counts.get(channel.id, 0) + 1
    if raw.log_time < walk.newest_ns:
        walk.late += 1
        walk.late_ns = max(walk.late_ns, walk.newest_ns - raw.log_time)
    walk.newest_ns = max(walk.newest_ns, raw.log_time)
    yield Message(
        channel=channel,
        schema=walk.schemas.get(channel.schema_id),
        log_time=raw.log_time,
        publish_time=raw.publish_time,
        sequence=raw.sequence,
        data=raw.data,
    )


def _declare(walk: ContainerScan, offset: int, record: Schema | Channel) -> None:
    where = f"byte {offset}"
    known = walk.schemas.get(record.id) if isinstance(record, Schema) else walk.channels.get(record.id)
    kind = "schema" if isinstance(record, Schema) else "channel"
    if known is not None and known != record:
        walk.findings.error(where, f"{kind} {record.id} is declared again and differently", kind="redeclared")
    if isinstance(record, Schema):
        if record.id == 0:
            walk.findings.error(where, "a schema has the id 0, which means none")
        walk.schemas[record.id] = record
    else:
        if record.schema_id and record.schema_id not in walk.schemas:
            what = f"channel {record.topic[:60]!r} names schema {record.schema_id}, which is declared nowhere before"
            walk.findings.error(where, what, RECOVER, kind="missing schema")
        walk.channels[record.id] = record


def _check_index(walk: ContainerScan, offset: int, record: MessageIndex) -> None:
    if walk.indexes_of is None:
        walk.findings.error(f"byte {offset}", "a message index that follows no chunk", RECOVER)
        return
    chunk, index = walk.indexes_of
    found = index.pop(record.channel_id, [])
    if sorted(found) != sorted(record.records):
        what = f"the message index of channel {record.channel_id} does not fit its messages"
        walk.findings.error(f"chunk at byte {chunk}", what, RECOVER, kind="message index")


def _check_indexes_complete(walk: ContainerScan) -> None:
    if walk.indexes_of is not None and walk.indexes_of[1] and not walk.damaged:
        where = f"chunk at byte {walk.indexes_of[0]}"
        walk.findings.add(Level.INFO, where, "messages without a message index", REWRITE, kind="no message index")
    walk.indexes_of = None


def _check_end(walk: ContainerScan, stream: BinaryIO) -> None:
    findings = walk.findings
    _check_indexes_complete(walk)
    if walk.late:
        stand = "1 message stands" if walk.late == 1 else f"{walk.late} messages stand"
        what = f"{stand} after a later one, by {walk.late_ns / 1e9:.3f} s at most"
        findings.add(Level.INFO, "order", what)
    if walk.data_end is not None:
        _check_data_crc(walk, stream)
    if walk.data_end is None or walk.footer is None:
        if not walk.cut_off and not walk.damaged and not walk.index_cut:
            findings.error("end", "the file has no footer", RECOVER)
        return
    stream.seek(walk.footer_end)
    end = stream.read(len(MAGIC) + 1)
    if end != MAGIC and MAGIC.startswith(end):
        findings.warning("end", f"the closing magic is cut off: {INDEX_CUT}", REBUILD)
        return
    if end != MAGIC:
        findings.error("end", "the closing magic is missing or something follows it", RECOVER)
    if walk.footer.summary_start == 0:
        findings.add(Level.INFO, "summary", "the file has no index", REWRITE)
        return
    stream.seek(walk.data_end[0])
    if (
        HEAD.unpack(stream.read(HEAD.size))[1] != DATA_END_BYTES
        or walk.footer.summary_start != stream.tell() + DATA_END_BYTES
    ):
        findings.error("summary", "it does not begin where the data end", RECOVER)
    index = read_summary(stream)
    if index is None:
        findings.error("summary", "the index at the end is damaged", RECOVER)
    elif not walk.damaged:
        _compare(walk, index)


def _check_data_crc(walk: ContainerScan, stream: BinaryIO) -> None:
    assert walk.data_end is not None
    end, expected = walk.data_end
    if not expected:
        return
    stream.seek(0)
    crc, left = 0, end
    while left and (block := stream.read(min(left, 1 << 20))):
        crc = zlib.crc32(block, crc)
        left -= len(block)
    if crc != expected and not walk.damaged:
        walk.findings.error("data", "the checksum over all data is wrong, though every chunk is right", RECOVER)


def _compare(walk: ContainerScan, index: LogIndex) -> None:
    """Compares the index with what the pass has seen of the file."""
    findings = walk.findings

    def differ(what: str) -> None:
        findings.error("summary", what, RECOVER, kind="summary")

    def lacks(what: str) -> None:
        findings.add(Level.INFO, "summary", f"it has no {what}, which are optional", REWRITE, kind=f"no {what}")

    _compare_statistics(walk, index, differ, lacks)
    _compare_chunks(walk, index, differ, lacks)
    for said, seen, name in (
        ({a.offset: a.name for a in index.attachments}, walk.attachments, "attachments"),
        ({m.offset: m.name for m in index.metadata}, walk.metadata, "metadata records"),
    ):
        if seen and not said:
            lacks(f"index of {name}")
        elif said != seen:
            differ(f"its index of {name} does not fit the file")
    if walk.channels and not index.channels:
        lacks("channels")
    for channel in walk.channels.values() if index.channels else ():
        if index.channels.get(channel.id) != channel:
            differ(f"channel {channel.id} is missing or another one")
    if walk.schemas and not index.schemas:
        lacks("schemas")


def _compare_statistics(walk: ContainerScan, index: LogIndex, differ: Report, lacks: Report) -> None:
    statistics = index.statistics
    if statistics is None:
        lacks("statistics")
        return
    counts = {channel: count for channel, count in statistics.channel_message_counts.items() if count}
    if counts and counts != walk.counts:  # an empty map says that they were not counted
        differ("its message counts are not those of the file")
    for name, said, seen in (
        ("messages", statistics.message_count, sum(walk.counts.values())),
        ("chunks", statistics.chunk_count, len(walk.chunks)),
        ("attachments", statistics.attachment_count, len(walk.attachments)),
        ("metadata records", statistics.metadata_count, len(walk.metadata)),
    ):
        if said != seen:
            differ(f"it counts {said} {name}, and there are {seen}")


def _compare_chunks(walk: ContainerScan, index: LogIndex, differ: Report, lacks: Report) -> None:
    if walk.chunks and not index.chunks:
        lacks("chunk indexes")
        return
    if sorted(c.chunk_start_offset for c in index.chunks) != sorted(walk.chunks):
        differ("its chunk offsets are not those of the file")
    for chunk in index.chunks:
        first, last, messages = walk.chunks.get(chunk.chunk_start_offset, (0, 0, 0))
        if messages and (chunk.message_start_time, chunk.message_end_time) != (first, last):
            differ(f"its times of the chunk at byte {chunk.chunk_start_offset} are wrong")
