"""The index at the end of a closed log, trusted only for what it holds.

The records of a summary are all optional (https://mcap.dev/spec#summary-section). An index is used only where its
checksum is right and where chunks, attachments and metadata that it lists account for every byte of the data, apart
from declarations and message indexes, which are looked up by their heads. Any other file is walked.
"""

from __future__ import annotations

import io
import itertools
import zlib
from collections.abc import Iterator
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, ChunkIndex, Footer, Header, MetadataIndex, Schema, Statistics

from recorders.mcap_io.index import MAGIC, LogIndex
from replayers.mcap_io.records import HEAD, MAX_RECORD_BYTES, Record, UnreadableRecord, parse

FOOTER_BYTES = HEAD.size + 20
DATA_END_BYTES = HEAD.size + 4
PRIVATE_FROM = 0x80
"""Opcodes from here on are for private records, which readers skip."""
DECLARATIONS = frozenset({int(Opcode.SCHEMA), int(Opcode.CHANNEL)})
UNLISTED = DECLARATIONS | {int(Opcode.HEADER), int(Opcode.MESSAGE_INDEX)}
"""Records of the data section that no index lists."""


def is_closed(stream: BinaryIO) -> bool:
    """Whether a file has the end that the specification asks for, with a summary or without one."""
    size = stream.seek(0, io.SEEK_END)
    footer = _footer(stream, size)
    if footer is None:
        return False
    end = footer.summary_start or footer.summary_offset_start or size - FOOTER_BYTES - len(MAGIC)
    if not DATA_END_BYTES < end < size:
        return False
    stream.seek(end - DATA_END_BYTES)
    return stream.read(1) == bytes([Opcode.DATA_END])


def read_index(stream: BinaryIO) -> LogIndex | None:
    """The index of a closed file that holds all that is in it; None where the file has to be walked.

    Message counts and times may be missing from it: `has_counts`.
    """
    index = read_summary(stream)
    if index is None or not _lists_everything(stream, index):
        return None
    return index


def has_counts(index: LogIndex) -> bool:
    """Whether an index holds the number of messages of each channel and the log's first and last time."""
    statistics = index.statistics
    return statistics is not None and index.messages == statistics.message_count


def indexed_messages(chunk: ChunkIndex) -> int | None:
    """How many messages a chunk has by the sizes of its message indexes; None where these do not show it.

    The indexes stand one after another, each with 15 bytes and 16 for each message.
    """
    end = chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length
    starts = [*sorted(chunk.message_index_offsets.values()), end]
    sizes = [after - before - 15 for before, after in itertools.pairwise(starts)]
    if not sizes or starts[0] != chunk.chunk_start_offset + chunk.chunk_length:
        return None
    return None if any(size < 0 or size % 16 for size in sizes) else sum(sizes) // 16


def read_summary(stream: BinaryIO) -> LogIndex | None:
    """What the summary of a closed file holds; None when it was not closed, or has no intact summary."""
    size = stream.seek(0, io.SEEK_END)
    tail = FOOTER_BYTES + len(MAGIC)
    footer = _footer(stream, size)
    if footer is None or not len(MAGIC) < footer.summary_start <= size - tail:
        return None
    if size - tail - footer.summary_start > MAX_RECORD_BYTES:
        return None
    try:
        stream.seek(footer.summary_start)
        body = stream.read(size - tail - footer.summary_start)
        head = stream.read(HEAD.size + 16)
        if footer.summary_crc and zlib.crc32(body + head) != footer.summary_crc:
            return None
        index = _filled(body)
        index.header = _header(stream)
    except UnreadableRecord:
        return None
    index.data_end = footer.summary_start - DATA_END_BYTES
    stream.seek(index.data_end)
    data_end = stream.read(DATA_END_BYTES)
    if not data_end or data_end[0] != Opcode.DATA_END:
        return None
    index.data_crc = int.from_bytes(data_end[HEAD.size :], "little")
    return index


def _footer(stream: BinaryIO, size: int) -> Footer | None:
    tail = FOOTER_BYTES + len(MAGIC)
    stream.seek(max(size - tail, 0))
    end = stream.read(tail)
    if len(end) < tail or end[-len(MAGIC) :] != MAGIC or end[0] != Opcode.FOOTER:
        return None
    try:
        footer, _ = parse(Opcode.FOOTER, end[HEAD.size : -len(MAGIC)])
    except UnreadableRecord:
        return None
    return footer if isinstance(footer, Footer) else None


def _lists_everything(stream: BinaryIO, index: LogIndex) -> bool:
    """Whether an index lists every chunk, attachment and metadata record, and all channels of its messages."""
    statistics = index.statistics
    if statistics is not None:
        said = (statistics.chunk_count, statistics.attachment_count, statistics.metadata_count)
        if said != (len(index.chunks), len(index.attachments), len(index.metadata)):
            return False
    for offset, opcode, length in _gaps(stream, index):
        if opcode in UNLISTED or opcode >= PRIVATE_FROM:
            if opcode in DECLARATIONS and not _learn_at(stream, index, offset, length):
                return False
        else:
            return False
    return _declares_all(index)


def _gaps(stream: BinaryIO, index: LogIndex) -> Iterator[tuple[int, int, int]]:
    """Offset, opcode and length of the records of the data section that the index does not list.

    Listed records that overlap, or that reach beyond the data, give a record of opcode 0.
    """
    listed = [(c.chunk_start_offset, c.chunk_length + c.message_index_length) for c in index.chunks]
    listed += [(entry.offset, entry.length) for entry in (*index.attachments, *index.metadata)]
    at = len(MAGIC)
    for start, length in [*sorted(listed), (index.data_end, 0)]:
        while at < start:
            stream.seek(at)
            head = stream.read(HEAD.size)
            opcode, size = HEAD.unpack(head) if len(head) == HEAD.size else (0, 0)
            if opcode == 0 or at + HEAD.size + size > start:
                yield at, 0, 0
                return
            yield at, opcode, size
            at += HEAD.size + size
        if start < at:
            yield start, 0, 0
            return
        at = start + length
    if at != index.data_end:
        yield at, 0, 0


def _learn_at(stream: BinaryIO, index: LogIndex, offset: int, length: int) -> bool:
    if length > MAX_RECORD_BYTES:
        return False
    stream.seek(offset)
    opcode, _ = HEAD.unpack(stream.read(HEAD.size))
    try:
        record, _ = parse(opcode, stream.read(length))
    except UnreadableRecord:
        return False
    index.learn(record)
    return True


def _declares_all(index: LogIndex) -> bool:
    """Whether every channel that has messages is declared, with its schema.

    Known where the message indexes of all chunks are listed, or where the statistics count the channels.
    """
    channels, statistics = index.channels, index.statistics
    if any(c.schema_id and c.schema_id not in index.schemas for c in channels.values()):
        return False
    if any(channel not in channels for chunk in index.chunks for channel in chunk.message_index_offsets):
        return False
    if all(chunk.message_index_offsets for chunk in index.chunks):
        return True
    return statistics is not None and statistics.channel_count == len(channels)


def _header(stream: BinaryIO) -> Header | None:
    stream.seek(len(MAGIC))
    opcode, length = HEAD.unpack(stream.read(HEAD.size))
    if opcode != Opcode.HEADER or length > MAX_RECORD_BYTES:
        return None
    record, _ = parse(opcode, stream.read(length))
    return record if isinstance(record, Header) else None


def _filled(body: bytes) -> LogIndex:
    """An index from the bytes of a summary section."""
    index = LogIndex()
    offset = 0
    while offset + HEAD.size <= len(body):
        opcode, length = HEAD.unpack_from(body, offset)
        start = offset + HEAD.size
        if start + length > len(body):
            raise UnreadableRecord("the summary ends inside a record")
        if opcode != Opcode.SUMMARY_OFFSET:
            _take(index, parse(opcode, body[start : start + length])[0])
        offset = start + length
    return index


def _take(index: LogIndex, record: Record | None) -> None:
    match record:
        case Schema():
            index.schemas[record.id] = record
        case Channel():
            index.channels[record.id] = record
        case ChunkIndex():
            index.chunks.append(record)
        case AttachmentIndex():
            index.attachments.append(record)
        case MetadataIndex():
            index.metadata.append(record)
        case Statistics():
            index.statistics = record
            index.counts = dict(record.channel_message_counts)
            index.first_ns, index.last_ns = record.message_start_time, record.message_end_time
        case _:
            pass
