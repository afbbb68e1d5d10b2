"""Copies logs without changing a byte of any message; channels are matched by their contents, not by their ids."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import TracebackType
from typing import Self, final

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, DataEnd, Header, Metadata, Schema

from recorders.mcap_io.chunk import Compression
from recorders.mcap_io.writer import CHUNK_BYTES, LIBRARY, DiskFull, McapWriter
from replayers.log_tools.read_ahead import read_ahead
from replayers.log_tools.whole_chunk import WholeChunk, whole_chunk
from replayers.mcap_io.messages import ChunkMessages, Message
from replayers.mcap_io.records import ChunkRecord, Record
from replayers.mcap_io.scan import Damage, open_log, scan
from replayers.mcap_io.summary import read_summary
from workbench.errors import CannotCreate, InputError, OutputExists
from workbench.files import draft_path, file_to_replace, remove_abandoned_drafts
from workbench.files import replace as replace_file
from workbench.log_schema.run_info import INFO_METADATA
from workbench.log_schema.settings_json import SETTINGS_ATTACHMENT, identity_in

MESSAGE_INDEXES = frozenset({int(Opcode.MESSAGE_INDEX)})
ChannelKey = tuple[str, str, str, str, bytes, tuple[tuple[str, str], ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class LogLayout:
    """Layout of the new file.

    Attributes:
        chunk_bytes: the size of new chunks before compression.
        kept_bytes: the least and the largest size of an intact chunk that is copied as it stands; None for any size.
    """

    compression: Compression = "zstd"
    chunk_bytes: int = CHUNK_BYTES
    kept_bytes: tuple[int, int] | None = None
    force: bool = False

    def keeps(self, chunk: WholeChunk) -> bool:
        """Whether a chunk may be copied as it stands."""
        min_bytes, max_bytes = self.kept_bytes or (0, len(chunk.data))
        return chunk.record.compression == self.compression and min_bytes <= len(chunk.data) <= max_bytes


class NoDiskSpace(InputError):
    """The disk is full; what was there before the copy is untouched."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"{path}: not written ({reason}). Free some space, or choose another -o/--output.")


@final
class LogCopier:
    """Writes messages of any logs to a new one. Equal channels of several logs become one; ids stay where free.

    A context manager. The new log is renamed to its final name when it is complete; until then, and whatever happens,
    an existing file of that name is left as it is.

    Raises:
        OutputExists: the output exists, and the style does not allow replacing it.
        CannotCreate, WrongKind: no file can be created there.
        NoDiskSpace: from the end of the context.
    """

    def __init__(self, path: Path | str, style: LogLayout, *, profile: str = "") -> None:
        self.path, self._style = file_to_replace(Path(path)), style
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
        remove_abandoned_drafts(self.path.parent)
        self._placed: dict[ChannelKey, tuple[Channel, Schema | None]] = {}
        self._channels: set[int] = set()
        self._schemas: dict[int, Schema] = {}

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
            raise NoDiskSpace(self.path, error.reason) from error

    def copy(self, message: Message, *, incompressible: bool = False) -> None:
        """Copies a message; `incompressible` is as of `McapWriter.add_message`."""
        self.writer.add_message(
            self.channel(message.channel, message.schema),
            message.data,
            log_time=message.log_time,
            publish_time=message.publish_time,
            sequence=message.sequence,
            incompressible=incompressible,
        )

    def copy_piece(self, piece: Message | WholeChunk) -> int:
        """Copies a message, or all of a chunk; returns how many messages it is."""
        if not isinstance(piece, WholeChunk):
            self.copy(piece)
            return 1
        if not self.copy_chunk(piece):
            for message in piece.messages():
                self.copy(message)
        return len(piece.places)

    def copy_chunk(self, chunk: WholeChunk) -> bool:
        """Copies a chunk as it stands; False, and nothing copied, where the layout or other ids do not allow that."""
        if not self._style.keeps(chunk):
            return False
        if any(self.place(*pair) != pair for pair in chunk.channels.values()):
            return False
        if any(isinstance(one, Schema) and self._place_schema(one) != one for one in chunk.declared):
            return False
        own = {id(one) for one in chunk.declared}
        for pair in chunk.channels.values():
            self._declare(*pair, but=own)
        self.writer.add_chunk(chunk.packed(), chunk.declared)
        return True

    def channel(self, channel: Channel, schema: Schema | None) -> int:
        """The id of a channel in the new log, declared when it is first needed."""
        placed = self.place(channel, schema)
        self._declare(*placed)
        return placed[0].id

    def reserve(self, sources: Iterable[Path]) -> None:
        """Reserves the ids of logs' channels, the largest log's first, so that most chunks are copied as they are."""
        for source in sorted(sources, key=lambda path: -path.stat().st_size):
            with open_log(source) as stream:
                summary = read_summary(stream)
            if summary is not None:
                for channel in summary.channels.values():
                    self.place(channel, summary.schemas.get(channel.schema_id))

    def place(self, channel: Channel, schema: Schema | None) -> tuple[Channel, Schema | None]:
        """A channel and its schema by the ids that they have in the new log: their own ones where these are free."""
        key = channel_key(channel, schema)
        found = self._placed.get(key)
        if found is None:
            schema = None if schema is None else self._place_schema(schema)
            number = channel.id if channel.id not in self._channels else max(self._channels) + 1
            self._channels.add(number)
            found = replace(channel, id=number, schema_id=0 if schema is None else schema.id), schema
            self._placed[key] = found
        return found

    def _place_schema(self, schema: Schema) -> Schema:
        key = (schema.name, schema.encoding, schema.data)
        found = next((s for s in self._schemas.values() if (s.name, s.encoding, s.data) == key), None)
        if found is None:
            number = schema.id if schema.id and schema.id not in self._schemas else max(self._schemas, default=0) + 1
            found = self._schemas[number] = replace(schema, id=number)
        return found

    def _declare(self, channel: Channel, schema: Schema | None, *, but: Collection[int] = ()) -> None:
        index = self.writer.index
        if schema is not None and schema.id not in index.schemas and id(schema) not in but:
            self.writer.declare(schema)
        if channel.id not in index.channels and id(channel) not in but:
            self.writer.declare(channel)

    def attach(self, record: Attachment) -> None:
        self.writer.add_attachment(
            record.name, record.media_type, record.data, log_time=record.log_time, create_time=record.create_time
        )

    def describe(self, record: Metadata) -> None:
        self.writer.add_metadata(record.name, record.metadata)

    def finish(self) -> None:
        """Completes the file, still under its temporary name.

        Waits until it is on disk, so that after a power cut the name never stands for a file that is not there.
        """
        self.writer.close()

    def keep(self) -> None:
        """Renames the finished file to its final name, unless another file has taken it meanwhile."""
        if self.path.exists() and not self._style.force:
            raise OutputExists(self.path)
        replace_file(self.writer.path, self.path)

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
        damages: the first MAX_KEPT_DAMAGES of them, in the order of the file.
        count: how many there were in all.
        ended: the data were read to the record that ends them; only indexes may come after it.
    """

    damages: list[Damage] = field(default_factory=list)
    count: int = 0
    messages: int = 0
    ended: bool = False

    MAX_KEPT_DAMAGES = 1000

    def add(self, damage: Damage) -> None:
        self.count += 1
        if len(self.damages) < self.MAX_KEPT_DAMAGES:
            self.damages.append(damage)

    @classmethod
    def sum(cls, losses: Iterable[ReadLoss]) -> ReadLoss:
        """What could not be read from several logs."""
        total = cls()
        for loss in losses:
            total.damages += loss.damages[: cls.MAX_KEPT_DAMAGES - len(total.damages)]
            total.count, total.messages = total.count + loss.count, total.messages + loss.messages
        return total

    @property
    def any(self) -> bool:
        return self.count > 0 or self.messages > 0

    @property
    def loses_content(self) -> bool:
        """Whether anything but bookkeeping was lost."""
        return self.messages > 0 or any(damage.loses_content for damage in self.damages)


Part = Message | Attachment | Metadata | Header
"""What a log holds, apart from bookkeeping."""


def contents(path: Path | str, loss: ReadLoss) -> Iterator[Part]:
    """Everything in a log that is not bookkeeping, in the order of the file; damage goes to `loss`."""
    for part in pieces(path, loss):
        if isinstance(part, WholeChunk):
            yield from part.messages()
        else:
            yield part


def pieces(
    path: Path | str, loss: ReadLoss, *, jumps: Mapping[int, int] | None = None
) -> Iterator[Part | WholeChunk]:
    """As contents, with intact chunks in one piece; read ahead in a thread.

    Args:
        jumps: as of `scan`.
    """
    return (part for _, part in read_ahead(pieces_at(path, loss, skip=MESSAGE_INDEXES, jumps=jumps)))


def pieces_at(
    path: Path | str,
    loss: ReadLoss,
    *,
    skip: frozenset[int] = frozenset(),
    jumps: Mapping[int, int] | None = None,
) -> Iterator[tuple[int, Part | WholeChunk]]:
    """The pieces of a log with the offsets of their records; skip and jumps are as of `scan`.

    Where the run's identity is damaged, the one that settings.json repeats comes last.
    """
    content = _reader_of(path, loss)
    identity, named = dict[str, str](), False
    with open_log(path) as stream:
        for offset, record in scan(stream, path=path, on_damage=loss.add, skip=skip, jumps=jumps):
            if isinstance(record, DataEnd):
                loss.ended = True
                break
            if isinstance(record, Attachment | Metadata | Header):
                named |= isinstance(record, Metadata) and record.name == INFO_METADATA
                if isinstance(record, Attachment) and record.name == SETTINGS_ATTACHMENT:
                    identity = identity_in(record.data)
                yield offset, record
            else:
                for piece in _pieces_of(offset, record, content):
                    yield offset, piece
        loss.messages += content.messages_lost
        damaged = [damage.offset for damage in loss.damages if damage.opcode == Opcode.METADATA]
        if identity and damaged and not named:
            yield damaged[0], Metadata(name=INFO_METADATA, metadata=identity)


def _pieces_of(offset: int, record: Record, content: ChunkMessages) -> Iterator[Message | WholeChunk]:
    """The messages of one record; a chunk in one piece where it is intact."""
    chunk = whole_chunk(record, content) if isinstance(record, ChunkRecord) else None
    if chunk is None:
        yield from content.messages_of(offset, record)
    else:
        yield chunk


def _reader_of(path: Path | str, loss: ReadLoss) -> ChunkMessages:
    """A reader of a log's messages that knows what the summary declares.

    It looks for any other declaration in the whole file: a lost chunk may have held the only one before its messages.
    """
    with open_log(path) as stream:
        summary = read_summary(stream)
    return ChunkMessages(
        on_damage=loss.add,
        channels={} if summary is None else summary.channels,
        schemas={} if summary is None else summary.schemas,
        look_up=lambda: declarations(path),
    )


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
            for _ in content.messages_of(offset, record):
                pass
    return content.channels, content.schemas
