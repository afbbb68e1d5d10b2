"""Intact chunks of a log, which can be copied as they are: their messages are known without decoding."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, final

from mcap.records import Channel, Schema

from recorders.mcap_io.chunk import PackedChunk
from recorders.mcap_io.stored_frame import StoredFrame, stored_frame
from replayers.mcap_io.messages import ChunkMessages, Message
from replayers.mcap_io.records import MAX_RECORD_BYTES, ChunkRecord, UnreadableRecord, message_head, walk_chunk


class _Place(NamedTuple):
    """Where a message stands in a chunk: of its record's head and its end, in bytes."""

    channel_id: int
    log_time: int
    start: int
    end: int


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class WholeChunk:
    """An intact chunk, unpacked, all of whose channels are declared, and none in two ways.

    Attributes:
        channels: those that it uses or declares, by id, each with its schema.
        declared: the schemas and channels that it declares.
        start_ns, end_ns: first and last log time of its messages; 0 without messages.
        stored: its compressed data, where they store the content as it is.
    """

    record: ChunkRecord
    data: bytes
    places: Sequence[_Place]
    channels: Mapping[int, tuple[Channel, Schema | None]]
    declared: Sequence[Schema | Channel]
    start_ns: int
    end_ns: int
    stored: StoredFrame | None = None

    def messages(self, wanted: Callable[[str, int], bool] | None = None) -> Iterator[Message]:
        """Its messages in order; with `wanted`, those whose topic and log time it takes."""
        data = self.data
        for channel_id, log_time, start, end in self.places:
            channel, schema = self.channels[channel_id]
            if wanted is None or wanted(channel.topic, log_time):
                sequence, publish_time, body = message_head(data, start)
                yield Message(channel, schema, log_time, publish_time, sequence, data[body:end])

    def packed(self) -> PackedChunk:
        """The chunk for another log; times, message indexes and a missing checksum are made from what it holds."""
        index: dict[int, list[tuple[int, int]]] = {}
        for channel_id, log_time, start, _ in self.places:
            index.setdefault(channel_id, []).append((log_time, start))
        return PackedChunk(
            data=self.record.packed,
            compression=self.record.compression,
            size=len(self.data),
            crc=self.record.uncompressed_crc or zlib.crc32(self.data),
            start_ns=self.start_ns,
            end_ns=self.end_ns,
            index=index,
            data_crc=None if self.stored is None else self.stored.frame_crc(),
        )


def whole_chunk(record: ChunkRecord, content: ChunkMessages) -> WholeChunk | None:
    """The chunk as one piece, its declarations learnt; None where it is damaged, or declares what is known otherwise.

    Args:
        content: the declarations before it.
    """
    try:
        data, stored = _unpacked(record)
        declared, places = walk_chunk(data)
    except UnreadableRecord:
        return None
    schemas = {s.id: s for s in declared if isinstance(s, Schema)}
    channels = {c.id: c for c in declared if isinstance(c, Channel)}
    for one in declared:
        known = (content.schemas if isinstance(one, Schema) else content.channels).get(one.id, one)
        if known != one or (schemas if isinstance(one, Schema) else channels)[one.id] != one:
            return None
    pairs: dict[int, tuple[Channel, Schema | None]] = {}
    for channel_id in dict.fromkeys([*channels, *(place[0] for place in places)]):
        channel = channels.get(channel_id) or content.channels.get(channel_id)
        schema = None
        if channel is not None and channel.schema_id:
            schema = schemas.get(channel.schema_id) or content.schemas.get(channel.schema_id)
        if channel is None or (schema is None and channel.schema_id):
            return None
        pairs[channel_id] = channel, schema
    for one in declared:
        content.learn(one)
    stamps = [place[1] for place in places]
    return WholeChunk(
        record=record,
        data=data,
        places=[_Place(*place) for place in places],
        channels=pairs,
        declared=declared,
        start_ns=min(stamps, default=0),
        end_ns=max(stamps, default=0),
        stored=stored,
    )


def _unpacked(record: ChunkRecord) -> tuple[bytes, StoredFrame | None]:
    """The records inside, checked, and the compressed data where they store them as they are.

    Raises:
        UnreadableRecord: as of `ChunkRecord.unpack`.
    """
    stored = None
    if record.compression == "zstd" and record.uncompressed_crc and record.uncompressed_size <= MAX_RECORD_BYTES:
        stored = stored_frame(record.packed)
    if stored is None or (stored.crc, stored.content_bytes) != (record.uncompressed_crc, record.uncompressed_size):
        return record.unpack(), None
    return stored.content(), stored
