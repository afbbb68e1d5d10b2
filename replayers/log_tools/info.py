"""A log at a glance: counts, times, channels and the run's identity, read from the index where there is one."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.records import Attachment, AttachmentIndex, ChunkIndex, DataEnd, Header, Metadata, MetadataIndex

from recorders.mcap_io.channels import STAMPS
from recorders.mcap_io.index import LogIndex
from replayers.log_tools.copy_log import ReadLoss
from replayers.log_tools.multi_run import run_and_name
from replayers.log_tools.time_origin import TimeOrigin, time_origin
from replayers.mcap_io.records import ChunkRecord, RawMessage, Record, UnreadableRecord, records_in
from replayers.mcap_io.scan import Damage, open_log, record_at, scan
from replayers.mcap_io.summary import has_counts, is_closed, read_index
from workbench.errors import LiosError
from workbench.log_schema.events import RunInfo
from workbench.log_schema.run_info import INFO_METADATA, OUTCOME_METADATA, info_from_metadata
from workbench.remote.path import path_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """A log at a glance.

    Attributes:
        closed: the file has its end, as a recorder that was not killed writes it.
        indexed: the description comes from the index; otherwise the whole file was read, because it was not closed
            or its index does not hold everything.
        metadata: the last record of each name.
        origin: the moment from which its seconds count.
        info: identity of the run; None in a log that holds none.
        outcome: as the recorder wrote it at the end; empty where the recording stopped earlier.
    """

    path: Path
    size_bytes: int
    index: LogIndex
    closed: bool
    indexed: bool
    loss: ReadLoss
    metadata: dict[str, dict[str, str]]
    info: RunInfo | None
    origin: TimeOrigin

    @property
    def outcome(self) -> dict[str, str]:
        return self.metadata.get(OUTCOME_METADATA, {})

    @property
    def runs(self) -> int:
        """How many runs it holds."""
        members = {run for run, name in map(run_and_name, self.metadata) if name == INFO_METADATA and run is not None}
        return len(members) or int(self.info is not None)

    @property
    def duration_s(self) -> float:
        return (self.index.last_ns - self.origin.stamp_ns) / 1e9

    @property
    def compression_ratio(self) -> float | None:
        """Uncompressed size of all chunks divided by their compressed size; None without chunks."""
        packed = sum(chunk.compressed_size for chunk in self.index.chunks)
        return sum(chunk.uncompressed_size for chunk in self.index.chunks) / packed if packed else None

    def channels(self) -> list[dict[str, Any]]:
        """One row for each channel, sorted by topic; stamps is "uncertain" for those of a topic's that are."""
        rows: list[dict[str, Any]] = []
        for channel in sorted(self.index.channels.values(), key=lambda c: (c.topic, c.id)):
            schema = self.index.schemas.get(channel.schema_id)
            count = self.index.counts.get(channel.id, 0)
            rows.append(
                {
                    "topic": channel.topic,
                    "schema": schema.name if schema else "",
                    "encoding": channel.message_encoding,
                    "messages": count,
                    "stamps": channel.metadata.get(STAMPS, ""),
                    "hz": round(count / self.duration_s, 3) if self.duration_s > 0 and count > 1 else None,
                }
            )
        return rows


def describe(path: Path | str) -> Description:
    """Describes a log.

    Raises:
        FileMissing, NoMcap: there is nothing to read.
    """
    path, loss = path_of(path), ReadLoss()
    found: dict[str, dict[str, str]] = {}
    with open_log(path) as stream:
        size = stream.seek(0, io.SEEK_END)
        index, closed = read_index(stream), is_closed(stream)
        indexed = index is not None and has_counts(index)
        if index is None or not indexed:
            index = LogIndex()
            for offset, record in scan(stream, path=path, on_damage=loss.add):
                if isinstance(record, DataEnd):
                    loss.ended = True
                    break
                _count(index, offset, record, loss)
                if isinstance(record, Metadata):
                    found[record.name] = record.metadata
        else:
            loss.ended = True
            for entry in index.metadata:
                record = record_at(stream, entry.offset, on_damage=loss.add)
                if isinstance(record, Metadata):
                    found[record.name] = record.metadata
    info = _identity(found)
    return Description(
        path=path,
        size_bytes=size,
        index=index,
        closed=closed,
        indexed=indexed,
        loss=loss,
        metadata=found,
        info=info,
        origin=time_origin(path, index, info),
    )


def _identity(found: dict[str, dict[str, str]]) -> RunInfo | None:
    try:
        return info_from_metadata(found[INFO_METADATA]) if INFO_METADATA in found else None
    except LiosError:
        return None


def _count(index: LogIndex, offset: int, record: Record, loss: ReadLoss) -> None:
    """An index built by reading the whole file, for a log that has none."""
    if isinstance(record, ChunkRecord):
        try:
            for _, inner in records_in(record.unpack_anyhow()):
                _count(index, offset, inner, loss)
        except UnreadableRecord as error:
            loss.add(Damage(offset, f"chunk: {error}", opcode=Opcode.CHUNK))
            return
        index.chunks.append(
            ChunkIndex(
                chunk_length=0,
                chunk_start_offset=offset,
                compression=record.compression,
                compressed_size=len(record.packed),
                message_end_time=record.end_ns,
                message_index_length=0,
                message_index_offsets={},
                message_start_time=record.start_ns,
                uncompressed_size=record.uncompressed_size,
            )
        )
    elif isinstance(record, RawMessage):
        index.count(record.channel_id, record.log_time)
    elif isinstance(record, Header):
        index.header = record
    elif isinstance(record, Metadata):
        index.metadata.append(MetadataIndex(offset=offset, length=0, name=record.name))
    elif isinstance(record, Attachment):
        entry = AttachmentIndex(
            offset=offset,
            length=0,
            log_time=record.log_time,
            create_time=record.create_time,
            data_size=len(record.data),
            name=record.name,
            media_type=record.media_type,
        )
        index.attachments.append(entry)
    else:
        index.learn(record)
