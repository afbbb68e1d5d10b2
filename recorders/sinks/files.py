"""Sinks of recorded messages, and the one that writes to one file or to parts of bounded size or duration.

LogFiles        to one file, or to parts of bounded size or time, each of which opens alone
RingBuffer      the last seconds in memory, saved on demand                        (ring_buffer.py)
ThreadedSink    to another sink in its own thread, without blocking the caller (threaded.py)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from glob import escape
from os import fsencode
from pathlib import Path
from typing import Protocol, final

from recorders.mcap_io.channels import ChannelSpec
from recorders.mcap_io.chunk import Compression
from recorders.mcap_io.file import part_path, remove_parts
from recorders.mcap_io.writer import CHUNK_BYTES, McapWriter
from workbench.errors import BadValue, OutputExists
from workbench.log_schema.run_info import PART_METADATA

REPEATED = ("lios.repeated", "true")
"""Channel metadata of messages that a part repeats; such messages are dropped when parts are merged."""


class Sink(Protocol):
    """A destination of recorded messages."""

    @property
    def path(self) -> Path:
        """The current or future output file."""
        ...

    def write(self, channel: ChannelSpec, data: bytes, *, log_time: int, publish_time: int | None = None) -> bool:
        """Write a message; False if it was dropped. Stamps are in nanoseconds."""
        ...

    def attach(self, name: str, media_type: str, data: bytes, *, log_time: int) -> None:
        """Write an attachment, which every part repeats."""
        ...

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        """Write a metadata record, which every part repeats."""
        ...

    def flush(self) -> None:
        """Sync all data to disk, or request that this happens soon."""
        ...

    def close(self) -> None:
        """Finish writing; safe to call twice."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitLimits:
    """When a log is continued in another file; None means never.

    Attributes:
        part_bytes: size in bytes after which a new file begins.
        part_s: log time in seconds after which a new file begins.
    """

    part_bytes: int | None = None
    part_s: float | None = None

    def __post_init__(self) -> None:
        if self.part_bytes is not None and self.part_bytes < 1:
            raise BadValue("the size of a part", self.part_bytes, "more than 0 bytes")
        if self.part_s is not None and self.part_s <= 0:
            raise BadValue("the length of a part", self.part_s, "more than 0 seconds")

    @property
    def never(self) -> bool:
        return self.part_bytes is None and self.part_s is None


@dataclass(frozen=True, slots=True)
class StoredMessage:
    """A message held in memory."""

    channel: ChannelSpec
    data: bytes
    log_time: int
    publish_time: int | None = None


@dataclass(slots=True)
class RepeatedData:
    """Data that every part repeats: attachments, metadata, and the last message of every latched channel."""

    attachments: dict[str, tuple[str, bytes, int]] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    latched: dict[ChannelSpec, StoredMessage] = field(default_factory=dict)

    def write_to(self, part: LogPart, log_time: int) -> None:
        """Write all repeated data; messages get the start time of the part."""
        for name, values in self.metadata.items():
            part.writer.add_metadata(name, values)
        for name, (media_type, data, stamp) in self.attachments.items():
            part.writer.add_attachment(name, media_type, data, log_time=stamp, create_time=stamp)
        for kept in self.latched.values():
            publish_time = kept.log_time if kept.publish_time is None else kept.publish_time
            channel = replace(kept.channel, metadata=(*kept.channel.metadata, REPEATED))
            part.write(StoredMessage(channel, kept.data, log_time, publish_time))


@final
class LogPart:
    """One file of a log: a writer with its channel ids."""

    def __init__(self, writer: McapWriter) -> None:
        self.writer = writer
        self.first_ns: int | None = None
        self._ids: dict[ChannelSpec, int] = {}

    def write(self, message: StoredMessage) -> None:
        channel = message.channel
        if channel not in self._ids:
            schema = 0
            if channel.schema_name:
                schema = self.writer.add_schema(channel.schema_name, channel.schema_encoding, channel.schema_data)
            self._ids[channel] = self.writer.add_channel(
                channel.topic, channel.message_encoding, schema, dict(channel.metadata)
            )
        if self.first_ns is None:
            self.first_ns = message.log_time
        self.writer.add_message(
            self._ids[channel], message.data, log_time=message.log_time, publish_time=message.publish_time
        )


@final
class LogFiles:
    """Writes to one file, or to parts `name_0000.mcap`, `name_0001.mcap`, ...; nothing is lost between parts.

    Raises:
        OutputExists: also if parts of an earlier log of that name exist, which could be confused with the new ones.
        CannotCreate, DiskFull: as for McapWriter.
    """

    def __init__(
        self,
        path: Path | str,
        *,
        split: SplitLimits | None = None,
        force: bool = False,
        chunk_bytes: int = CHUNK_BYTES,
        compression: Compression = "zstd",
    ) -> None:
        self._path = Path(path)
        self._split = split or SplitLimits()
        self._force = force
        self._chunk_bytes = chunk_bytes
        self._compression: Compression = compression
        self._standing = RepeatedData()
        self.parts: list[Path] = []
        if not self._split.never:
            self._refuse_parts_of_another_log() if not force else remove_parts(self._path, beyond=1)
        self._part = self._open_part()

    @property
    def path(self) -> Path:
        return self._part.writer.path

    @property
    def bytes_in_hand(self) -> int:
        return self._part.writer.bytes_in_hand

    def write(self, channel: ChannelSpec, data: bytes, *, log_time: int, publish_time: int | None = None) -> bool:
        if self._is_full(log_time):
            self._next_part(log_time)
        message = StoredMessage(channel, data, log_time, publish_time)
        self._part.write(message)
        if channel.latched and not self._split.never:
            self._standing.latched[channel] = message
        return True

    def attach(self, name: str, media_type: str, data: bytes, *, log_time: int) -> None:
        self._part.writer.add_attachment(name, media_type, data, log_time=log_time, create_time=log_time)
        if not self._split.never:
            self._standing.attachments[name] = (media_type, data, log_time)

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        self._part.writer.add_metadata(name, values)
        if not self._split.never:
            self._standing.metadata[name] = dict(values)

    def flush(self) -> None:
        self._part.writer.flush()

    def close(self) -> None:
        self._part.writer.close()

    def abandon(self) -> None:
        """Stop writing without finishing, as in a crash."""
        self._part.writer.abandon()

    def _is_full(self, log_time: int) -> bool:
        writer, split = self._part.writer, self._split
        if split.part_bytes is not None and writer.bytes_written + writer.bytes_in_hand >= split.part_bytes:
            return self._part.first_ns is not None
        if split.part_s is not None and self._part.first_ns is not None:
            return log_time - self._part.first_ns >= split.part_s * 1e9
        return False

    def _next_part(self, log_time: int) -> None:
        before = self._part
        self._part = self._open_part()
        before.writer.close()
        self._standing.write_to(self._part, log_time)
        self._part.writer.flush()

    def _refuse_parts_of_another_log(self) -> None:
        pattern = f"{escape(self._path.stem)}_[0-9][0-9][0-9][0-9]{escape(self._path.suffix)}"
        for there in sorted(self._path.parent.glob(pattern)):
            raise OutputExists(there)

    def _open_part(self) -> LogPart:
        path = self._path
        if not self._split.never:
            path = part_path(path, len(self.parts))
        writer = McapWriter(
            path,
            force=self._force,
            chunk_bytes=self._chunk_bytes,
            compression=self._compression,
        )
        if not self._split.never:
            before = fsencode(self.parts[-1].name).decode("utf-8", "replace") if self.parts else ""
            writer.add_metadata(PART_METADATA, {"part": str(len(self.parts)), "before": before})
        self.parts.append(path)
        return LogPart(writer)
