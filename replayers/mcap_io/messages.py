"""Messages from a log's records: tracks schemas and channels and leaves unwanted messages out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple, final

from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from replayers.mcap_io.records import ChunkRecord, RawMessage, Record, UnreadableRecord, records_in
from replayers.mcap_io.scan import Damage, OnDamage


class Message(NamedTuple):
    """An undecoded message with its channel and schema. Stamps are in nanoseconds."""

    channel: Channel
    schema: Schema | None
    log_time: int
    publish_time: int
    sequence: int
    data: bytes

    @property
    def topic(self) -> str:
        return self.channel.topic


@final
@dataclass(slots=True)
class ChunkMessages:
    """Turns records into messages: tracks schemas and channels, and which are wanted.

    Attributes:
        messages_lost: messages whose channel is not declared anywhere before them.
        look_up: all that the log declares anywhere, asked for once, when a declaration is missing.
    """

    on_damage: OnDamage | None = None
    topics: Callable[[str], bool] | None = None
    start_ns: int = 0
    end_ns: int | None = None
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    messages_lost: int = 0
    look_up: Callable[[], tuple[dict[int, Channel], dict[int, Schema]]] | None = None
    _wanted: dict[int, tuple[Channel, Schema | None]] = field(default_factory=dict)
    _unwanted: set[int] = field(default_factory=set)

    def report(self, damage: Damage) -> None:
        if self.on_damage is not None:
            self.on_damage(damage)

    def messages_of(self, offset: int, record: Record | None) -> Iterator[Message]:
        """The wanted messages of one record: many for a chunk, one for a message, none for any other record."""
        if isinstance(record, ChunkRecord):
            try:
                for _, inner in records_in(record.unpack_anyhow(), unwanted=self._unwanted):
                    if type(inner) is RawMessage:
                        message = self._message(offset, inner)
                        if message is not None:
                            yield message
                    else:
                        self.learn(inner)
            except UnreadableRecord as error:
                self.report(Damage(offset, f"chunk: {error}", opcode=Opcode.CHUNK))
        elif isinstance(record, RawMessage):
            message = self._message(offset, record)
            if message is not None:
                yield message
        else:
            self.learn(record)

    def learn(self, record: Record | None) -> None:
        """Keeps a schema or channel for the messages after it; other records are ignored."""
        if isinstance(record, Channel) and self.channels.get(record.id) is not record:
            self.channels[record.id] = record
        elif isinstance(record, Schema) and self.schemas.get(record.id) is not record:
            self.schemas[record.id] = record
        else:
            return
        self._wanted.clear()
        self._unwanted.clear()

    def _message(self, offset: int, raw: RawMessage) -> Message | None:
        wanted = self._wanted.get(raw.channel_id) or self._register_channel(offset, raw.channel_id)
        early = raw.log_time < self.start_ns
        if wanted is None or early or (self.end_ns is not None and raw.log_time >= self.end_ns):
            return None
        channel, schema = wanted
        return Message(channel, schema, raw.log_time, raw.publish_time, raw.sequence, raw.data)

    def _register_channel(self, offset: int, channel_id: int) -> tuple[Channel, Schema | None] | None:
        """A channel with its schema, cached; None, cached too, where it is not wanted."""
        channel = self.channels.get(channel_id)
        if self.look_up is not None and (channel is None or channel.schema_id not in (0, *self.schemas)):
            channels, schemas = self.look_up()
            self.look_up = None
            self.channels, self.schemas = channels | self.channels, schemas | self.schemas
            channel = self.channels.get(channel_id)
        if channel is None:
            if not self.messages_lost:
                what = f"messages of channel {channel_id}, which is declared nowhere before"
                self.report(Damage(offset, what, opcode=Opcode.MESSAGE))
            self.messages_lost += 1
            return None
        if self.topics is not None and not self.topics(channel.topic):
            self._unwanted.add(channel_id)
            return None
        self._wanted[channel_id] = channel, self.schemas.get(channel.schema_id)
        return self._wanted[channel_id]
