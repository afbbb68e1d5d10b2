"""Copies logs without changing a byte of any message; channels are matched by their contents, not by their ids."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Self, final

from mcap.records import Attachment, Channel, DataEnd, Header, Metadata, Schema

from recorders.mcap_io.chunk import Compression
from recorders.mcap_io.file import CannotCreate
from recorders.mcap_io.writer import CHUNK_BYTES, LIBRARY, DiskFull, McapWriter
from replayers.mcap_io.messages import ChunkMessages, Message
from replayers.mcap_io.records import Record
from replayers.mcap_io.scan import Damage, open_log, scan
from replayers.mcap_io.summary import is_closed, read_summary
from workbench.errors import Failed, OutputExists, WrongKind
from workbench.files import draft_path, remove_abandoned_drafts, replace

ChannelKey = tuple[str, str, str, str, bytes, tuple[tuple[str, str], ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class LogLayout:
    """Layout of the new file."""

    compression: Compression = "zstd"
    chunk_bytes: int = CHUNK_BYTES
    force: bool = False


class NoRoom(Failed):
    """The disk is full; what was there before the copy is untouched."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: not written ({reason}). Free some space, or choose another -o/--output.")


@final
class Copier:
    """Writes messages of any logs to a new one. Equal channels of several logs become one; ids are assigned anew.

    A context manager. The new log is renamed to its final name when it is complete; until then, and whatever happens,
    an existing file of that name is left as it is.

    Raises:
        OutputExists: the output exists, and the style does not allow replacing it.
        CannotCreate, WrongKind: no file can be created there.
        NoRoom: from the end of the context.
    """

    def __init__(self, path: Path | str, style: LogLayout, *, profile: str = "") -> None:
        self.path, self._force = Path(path), style.force
        if self.path.is_dir():
            raise WrongKind(self.path, needed="file")
        if self.path.exists() and not style.force:
            raise OutputExists(self.path)
        try:
            self.writer = McapWriter(
                draft_path(self.path),
                compression=style.compression,
                chunk_bytes=style.chunk_bytes,
                force=True,
                profile=profile,
                library=LIBRARY,
            )
        except CannotCreate as error:
            raise CannotCreate(self.path, error.reason) from error
        remove_abandoned_drafts(self.path)
        self._ids: dict[ChannelKey, int] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if error is None:
                self.finish()
                self.keep()
        except DiskFull as full:
            error = full
        finally:
            self.discard()
        if isinstance(error, DiskFull):
            raise NoRoom(self.path, error.reason) from error

    def copy(self, message: Message) -> None:
        self.writer.add_message(
            self.channel(message.channel, message.schema),
            message.data,
            log_time=message.log_time,
            publish_time=message.publish_time,
            sequence=message.sequence,
        )

    def channel(self, channel: Channel, schema: Schema | None) -> int:
        """The id of a channel in the new log, declared when it is first needed."""
        key = channel_key(channel, schema)
        if key not in self._ids:
            schema_id = self.writer.add_schema(schema.name, schema.encoding, schema.data) if schema else 0
            self._ids[key] = self.writer.add_channel(
                channel.topic, channel.message_encoding, schema_id, channel.metadata
            )
        return self._ids[key]

    def attach(self, record: Attachment) -> None:
        self.writer.add_attachment(
            record.name, record.media_type, record.data, log_time=record.log_time, create_time=record.create_time
        )

    def describe(self, record: Metadata) -> None:
        self.writer.add_metadata(record.name, record.metadata)

    def finish(self) -> None:
        """Completes the file, still under its temporary name."""
        self.writer.close()

    def keep(self) -> None:
        """Renames the finished file to its final name, unless another file has taken it meanwhile."""
        if self.path.exists() and not self._force:
            raise OutputExists(self.path)
        replace(self.writer.path, self.path)

    def discard(self) -> None:
        """Removes a file that has not been renamed to its final name."""
        self.writer.abandon()
        self.writer.path.unlink(missing_ok=True)


def channel_key(channel: Channel, schema: Schema | None) -> ChannelKey:
    """The key by which channels of two files are the same channel."""
    return (
        channel.topic,
        channel.message_encoding,
        schema.name if schema else "",
        schema.encoding if schema else "",
        schema.data if schema else b"",
        tuple(sorted(channel.metadata.items())),
    )


@dataclass(slots=True)
class ReadLoss:
    """What could not be read from a log.

    Attributes:
        damages: the first MANY of them, in the order of the file.
        count: how many there were in all.
    """

    damages: list[Damage] = field(default_factory=list)
    count: int = 0
    messages: int = 0

    MANY = 1000

    def add(self, damage: Damage) -> None:
        self.count += 1
        if len(self.damages) < self.MANY:
            self.damages.append(damage)

    @property
    def any(self) -> bool:
        return self.count > 0 or self.messages > 0


def contents(path: Path | str, loss: ReadLoss) -> Iterator[Message | Attachment | Metadata | Header]:
    """Everything in a log that is not bookkeeping, in the order of the file; damage goes to `loss`."""
    channels, schemas = _known_declarations(path)
    content = ChunkMessages(on_damage=loss.add, channels=channels, schemas=schemas)
    with open_log(path) as stream:
        for offset, record in scan(stream, path=path, on_damage=loss.add):
            if isinstance(record, DataEnd):
                break
            if isinstance(record, Attachment | Metadata | Header):
                yield record
            else:
                yield from content.messages_of(offset, record)
        loss.messages += content.messages_lost


def _known_declarations(path: Path | str) -> tuple[dict[int, Channel], dict[int, Schema]]:
    """Channels and schemas by the summary; of a log without one, by all of it: a lost chunk may have held the only
    declaration before its messages."""
    with open_log(path) as stream:
        summary, closed = read_summary(stream), is_closed(stream)
    if summary is not None and summary.channels:
        return summary.channels, summary.schemas
    return ({}, {}) if closed else declarations(path)


def profile_of(path: Path | str) -> str:
    """The profile in a log's header; "" without one."""
    with open_log(path) as stream:
        for _, record in scan(stream, path=path, on_damage=lambda damage: None):
            return record.profile if isinstance(record, Header) else ""
    return ""


def declarations(path: Path | str) -> tuple[dict[int, Channel], dict[int, Schema]]:
    """All channels and schemas that any part of a log declares, including its summary."""
    content = ChunkMessages()
    with open_log(path) as stream:
        for offset, record in scan(stream, path=path, on_damage=lambda damage: None):
            _learn(content, offset, record)
    return content.channels, content.schemas


def _learn(content: ChunkMessages, offset: int, record: Record) -> None:
    for _ in content.messages_of(offset, record):
        pass
