"""How does one log become another, no byte of a message changed? Messages as they are, channels by what they are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import final

from mcap.records import Attachment, Channel, DataEnd, Header, Metadata, Schema

from recorders.chunk import Compression
from recorders.writer import CHUNK_BYTES, LIBRARY, McapWriter
from replayers.content import Content, Message
from replayers.mcap_records import Record
from replayers.scanning import Damage, open_log, scan

ChannelKey = tuple[str, str, str, str, bytes, tuple[tuple[str, str], ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """How the new file is laid out."""

    compression: Compression = "zstd"
    chunk_bytes: int = CHUNK_BYTES
    force: bool = False


@final
class Copier:
    """Writes messages of any logs to a new one. Equal channels of several logs become one; ids are given anew.

    Raises:
        OutputExists, CannotCreate, DiskFull: as McapWriter.
    """

    def __init__(self, path: Path | str, style: Style, *, profile: str = "") -> None:
        self.writer = McapWriter(
            path,
            compression=style.compression,
            chunk_bytes=style.chunk_bytes,
            force=style.force,
            profile=profile,
            library=LIBRARY,
        )
        self._ids: dict[ChannelKey, int] = {}

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

    def close(self) -> None:
        self.writer.close()

    def discard(self) -> None:
        """Takes the unfinished file away."""
        self.writer.abandon()
        self.writer.path.unlink(missing_ok=True)


def channel_key(channel: Channel, schema: Schema | None) -> ChannelKey:
    """What makes two channels of two files the same."""
    return (
        channel.topic,
        channel.message_encoding,
        schema.name if schema else "",
        schema.encoding if schema else "",
        schema.data if schema else b"",
        tuple(sorted(channel.metadata.items())),
    )


@dataclass(slots=True)
class Loss:
    """What could not be read of a log.

    Attributes:
        damages: the first MANY of them.
        count: of all.
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


def contents(path: Path | str, loss: Loss) -> Iterator[Message | Attachment | Metadata | Header]:
    """Everything in a log that is not bookkeeping, in the order of the file; damage goes to `loss`."""
    content = Content(on_damage=loss.add)
    with open_log(path) as stream:
        for offset, record in scan(stream, path=path, on_damage=loss.add):
            if isinstance(record, DataEnd):
                break
            if isinstance(record, Attachment | Metadata | Header):
                yield record
            else:
                yield from content.messages_of(offset, record)
        loss.messages += content.messages_lost


def profile_of(path: Path | str) -> str:
    """The profile in a log's header; "" where there is none."""
    with open_log(path) as stream:
        for _, record in scan(stream, path=path, on_damage=lambda damage: None):
            return record.profile if isinstance(record, Header) else ""
    return ""


def declarations(path: Path | str) -> tuple[dict[int, Channel], dict[int, Schema]]:
    """All channels and schemas that any part of a log declares, its summary included."""
    content = Content()
    with open_log(path) as stream:
        for offset, record in scan(stream, path=path, on_damage=lambda damage: None):
            _learn(content, offset, record)
    return content.channels, content.schemas


def _learn(content: Content, offset: int, record: Record) -> None:
    for _ in content.messages_of(offset, record):
        pass
