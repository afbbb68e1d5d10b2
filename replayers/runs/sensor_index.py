"""Index of the pictures, clouds, grids, transforms and session states of a log; messages are read on request.

Their stamps are found once. The index of a closed log says where every message begins, so that an hour of pictures
costs a few kilobytes; a log that was cut off is read through once. Nothing is decoded before it is requested.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, BinaryIO, final

import numpy as np
from mcap.records import Channel, DataEnd, MessageIndex, Schema

from recorders.mcap_io.index import LogIndex
from replayers.mcap_io.records import ChunkRecord, RawMessage, UnreadableRecord, parse, records_in
from replayers.mcap_io.scan import open_log, record_at, scan
from replayers.mcap_io.summary import read_index
from workbench.arrays import Ints
from workbench.caches import Cache
from workbench.remote.path import path_of

if TYPE_CHECKING:
    from mcap_protobuf.decoder import DecoderFactory

PICTURE, CLOUD, GRID = "foxglove.CompressedImage", "foxglove.PointCloud", "foxglove.Grid"
TRANSFORMS, LENS, SPOT_IMAGE = "foxglove.FrameTransforms", "foxglove.CameraCalibration", "bosdyn.api.ImageResponse"
KINDS = frozenset({PICTURE, CLOUD, GRID, TRANSFORMS, LENS, SPOT_IMAGE})
SESSION_STATUS = "lios.spot.SessionStatus"
"""The one kind in JSON: how a robot's session goes."""
MESSAGE_OPCODE, MESSAGE_HEAD = 5, 9
NOT_IN_A_CHUNK = -1
KEPT_CHUNKS = 4
"""Decompressed chunks in the cache: neighbours in time are mostly in the same chunk."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TopicIndex:
    """One topic: when its messages came, and where they stand.

    Attributes:
        stamps_ns: log times in nanoseconds, sorted, int64 (n,).
        where: for each message, the offset of its chunk in the file and its own offset in the chunk, int64 (n, 2).
    """

    topic: str
    schema: Schema
    stamps_ns: Ints
    where: Ints

    def last_at(self, stamp_ns: int) -> int:
        """The index of the newest message at a moment, or -1 before the first."""
        return int(np.searchsorted(self.stamps_ns, stamp_ns, side="right")) - 1


@final
@dataclass
class SensorTracks:
    """The sensor tracks of one log. Thread-safe."""

    path: Path
    tracks: Mapping[str, TopicIndex]
    _chunks: Cache[int, bytes] = field(default_factory=lambda: Cache(KEPT_CHUNKS))
    _lock: Lock = field(default_factory=Lock)

    def of_kind(self, schema: str) -> tuple[TopicIndex, ...]:
        """The tracks of a schema, by topic."""
        return tuple(self.tracks[topic] for topic in sorted(self.tracks) if self.tracks[topic].schema.name == schema)

    def message(self, track: TopicIndex, index: int) -> Any | None:
        """A message, decoded; None where the file is damaged or the bytes are not such a message."""
        from google.protobuf.message import DecodeError

        data = self.data(track, index)
        decode = self._decoders.decoder_for("protobuf", track.schema)
        if data is None or decode is None:
            return None
        try:
            return decode(data)
        except DecodeError:
            return None

    def data(self, track: TopicIndex, index: int) -> bytes | None:
        """A message as it stands in the file; None where that is damaged."""
        return self._bytes(int(track.where[index, 0]), int(track.where[index, 1]))

    @cached_property
    def _decoders(self) -> DecoderFactory:
        from mcap_protobuf.decoder import DecoderFactory

        return DecoderFactory()

    def _bytes(self, chunk_at: int, offset: int) -> bytes | None:
        with self._lock, open_log(self.path) as stream:
            if chunk_at == NOT_IN_A_CHUNK:
                record = record_at(stream, offset)
                return record.data if isinstance(record, RawMessage) else None
            data = self._chunk(stream, chunk_at)
        if data is None or not 0 <= offset <= len(data) - MESSAGE_HEAD or data[offset] != MESSAGE_OPCODE:
            return None
        length = int.from_bytes(data[offset + 1 : offset + MESSAGE_HEAD], "little")
        try:
            record, _ = parse(MESSAGE_OPCODE, data[offset + MESSAGE_HEAD : offset + MESSAGE_HEAD + length])
        except UnreadableRecord:
            return None
        return record.data if isinstance(record, RawMessage) else None

    def _chunk(self, stream: BinaryIO, at: int) -> bytes | None:
        kept = self._chunks.find(at)
        if kept is not None:
            return kept
        record = record_at(stream, at)
        if not isinstance(record, ChunkRecord):
            return None
        try:
            data = record.unpack_anyhow()
        except UnreadableRecord:
            return None
        self._chunks.put(at, data)
        return data


def sensor_tracks(path: Path | str) -> SensorTracks:
    """The sensor tracks of a log; none for a log without sensors.

    Raises:
        FileMissing, NoMcap: no file, or no MCAP file.
    """
    found = _PositionCollector()
    with open_log(path) as stream:
        index = read_index(stream)
        if index is None:
            _walk(stream, path, found)
        else:
            _by_index(stream, index, found)
    return SensorTracks(path=path_of(path), tracks=found.tracks())


@dataclass(slots=True)
class _PositionCollector:
    """Message positions collected while the file is read."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    rows: dict[int, list[tuple[int, int, int]]] = field(default_factory=dict)

    def wants(self, channel_id: int) -> bool:
        channel = self.channels.get(channel_id)
        schema = self.schemas.get(channel.schema_id) if channel is not None else None
        return channel is not None and schema is not None and _is_kind(schema, channel.message_encoding)

    def take(self, record: object, chunk_at: int, offset: int) -> None:
        if isinstance(record, Schema):
            self.schemas[record.id] = record
        elif isinstance(record, Channel):
            self.channels[record.id] = record
        elif isinstance(record, RawMessage) and self.wants(record.channel_id):
            self.rows.setdefault(record.channel_id, []).append((record.log_time, chunk_at, offset))

    def tracks(self) -> dict[str, TopicIndex]:
        """The tracks; channels of one topic form one track."""
        by_topic: dict[str, list[tuple[int, int, int]]] = {}
        schemas: dict[str, Schema] = {}
        for channel_id in sorted(self.rows):
            channel = self.channels[channel_id]
            schema = schemas.setdefault(channel.topic, self.schemas[channel.schema_id])
            if schema.name == self.schemas[channel.schema_id].name:
                by_topic.setdefault(channel.topic, []).extend(self.rows[channel_id])
        made: dict[str, TopicIndex] = {}
        for topic, rows in by_topic.items():
            table = np.array(sorted(rows), dtype=np.int64)
            made[topic] = TopicIndex(topic=topic, schema=schemas[topic], stamps_ns=table[:, 0], where=table[:, 1:])
        return made


def _is_kind(schema: Schema, encoding: str) -> bool:
    if schema.name == SESSION_STATUS:
        return (encoding, schema.encoding) == ("json", "jsonschema")
    return schema.name in KINDS and encoding == schema.encoding == "protobuf"


def _by_index(stream: BinaryIO, index: LogIndex, found: _PositionCollector) -> None:
    found.schemas, found.channels = dict(index.schemas), dict(index.channels)
    for chunk in index.chunks:
        if not chunk.message_index_offsets:
            _inside(record_at(stream, chunk.chunk_start_offset), chunk.chunk_start_offset, found)
        for channel_id, offset in sorted(chunk.message_index_offsets.items()):
            if not found.wants(channel_id):
                continue
            entries = record_at(stream, offset)
            if isinstance(entries, MessageIndex):
                rows = found.rows.setdefault(channel_id, [])
                rows += [(stamp, chunk.chunk_start_offset, at) for stamp, at in entries.records]


def _walk(stream: BinaryIO, path: Path | str, found: _PositionCollector) -> None:
    for offset, record in scan(stream, path=path, on_damage=lambda damage: None):
        if isinstance(record, DataEnd):
            return
        if isinstance(record, ChunkRecord):
            _inside(record, offset, found)
        else:
            found.take(record, NOT_IN_A_CHUNK, offset)


def _inside(record: object, offset: int, found: _PositionCollector) -> None:
    if not isinstance(record, ChunkRecord):
        return
    try:
        for inner_offset, inner in records_in(record.unpack_anyhow()):
            found.take(inner, offset, inner_offset)
    except UnreadableRecord:
        return
