"""The index at the end of a closed log, trusted only when its checksum is right."""

from __future__ import annotations

import io
import zlib
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, ChunkIndex, Footer, Header, MetadataIndex, Schema, Statistics

from recorders.mcap_io.index import MAGIC, LogIndex
from replayers.mcap_io.records import HEAD, MAX_RECORD_BYTES, Record, UnreadableRecord, parse

FOOTER_BYTES = HEAD.size + 20


def read_index(stream: BinaryIO) -> LogIndex | None:
    """The index at the end of a closed file; None when it was not closed or its summary is damaged."""
    size = stream.seek(0, io.SEEK_END)
    tail = FOOTER_BYTES + len(MAGIC)
    stream.seek(max(size - tail, 0))
    end = stream.read(tail)
    if len(end) < tail or end[-len(MAGIC) :] != MAGIC or end[0] != Opcode.FOOTER:
        return None
    try:
        footer, _ = parse(Opcode.FOOTER, end[HEAD.size : -len(MAGIC)])
        if not isinstance(footer, Footer) or not len(MAGIC) < footer.summary_start <= size - tail:
            return None
        if size - tail - footer.summary_start > MAX_RECORD_BYTES:
            return None
        stream.seek(footer.summary_start)
        body = stream.read(size - tail - footer.summary_start)
        if footer.summary_crc and zlib.crc32(body + end[: HEAD.size + 16]) != footer.summary_crc:
            return None
        index = _filled(body)
        index.header = _header(stream)
    except UnreadableRecord:
        return None
    index.data_end = footer.summary_start - HEAD.size - 4
    stream.seek(index.data_end)
    data_end = stream.read(HEAD.size + 4)
    if not data_end or data_end[0] != Opcode.DATA_END:
        return None
    index.data_crc = int.from_bytes(data_end[HEAD.size :], "little")
    return index


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
