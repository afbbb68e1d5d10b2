"""A closed log of any size that takes no room on the disk: its chunks are holes in a sparse file."""

from __future__ import annotations

import io
import zlib
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, DataEnd, Footer, Header, Metadata, MetadataIndex, Schema, Statistics

from recorders.mcap_io.index import MAGIC
from workbench.log_schema.run_info import OUTCOME_METADATA

CHUNK_BYTES = 4 << 20
CHUNK_HEAD = 9 + 40


def write_large_log(path: Path, size: int) -> Path:
    """Writes a log whose index is right, of at least `size` bytes."""
    chunks: list[ChunkIndex] = []
    metadata = Metadata(name=OUTCOME_METADATA, metadata={"status": "done", "cost": "1.5"})
    with path.open("wb") as stream:
        stream.write(MAGIC + _record(Header(profile="", library="test")))
        at = stream.tell()
        stream.write(_record(metadata))
        entry = MetadataIndex(offset=at, length=stream.tell() - at, name=metadata.name)
        while stream.tell() < size:
            chunks.append(_chunk(stream, len(chunks)))
        stream.write(_record(DataEnd(data_section_crc=0)))
        _summarise(stream, chunks, entry)
    return path


def _chunk(stream: BinaryIO, number: int) -> ChunkIndex:
    start, end = number * 10**9, (number + 1) * 10**9 - 1
    at = stream.tell()
    head = bytes([Opcode.CHUNK]) + (40 + CHUNK_BYTES).to_bytes(8, "little")
    body = b"".join(n.to_bytes(8, "little") for n in (start, end, CHUNK_BYTES)) + bytes(4) + bytes(4)
    stream.write(head + body + CHUNK_BYTES.to_bytes(8, "little"))
    stream.seek(at + CHUNK_HEAD + CHUNK_BYTES)
    return ChunkIndex(
        chunk_length=CHUNK_HEAD + CHUNK_BYTES,
        chunk_start_offset=at,
        compression="",
        compressed_size=CHUNK_BYTES,
        message_end_time=end,
        message_index_length=0,
        message_index_offsets={},
        message_start_time=start,
        uncompressed_size=CHUNK_BYTES,
    )


def _summarise(stream: BinaryIO, chunks: list[ChunkIndex], entry: MetadataIndex) -> None:
    start = stream.tell()
    statistics = Statistics(
        attachment_count=0,
        channel_count=1,
        channel_message_counts={1: len(chunks)},
        chunk_count=len(chunks),
        message_count=len(chunks),
        message_end_time=chunks[-1].message_end_time,
        message_start_time=0,
        metadata_count=1,
        schema_count=1,
    )
    schema = Schema(id=1, name="test.Bytes", encoding="jsonschema", data=b"{}")
    channel = Channel(id=1, topic="/camera", message_encoding="json", metadata={}, schema_id=1)
    body = b"".join(map(_record, (schema, channel, statistics, *chunks, entry)))
    footer = _record(Footer(summary_start=start, summary_offset_start=0, summary_crc=0))
    crc = zlib.crc32(body + footer[:-4])
    stream.write(body + footer[:-4] + crc.to_bytes(4, "little") + MAGIC)


def _record(record: object) -> bytes:
    builder = RecordBuilder()
    record.write(builder)  # pyright: ignore[reportAttributeAccessIssue]
    return io.BytesIO(builder.end()).getvalue()
