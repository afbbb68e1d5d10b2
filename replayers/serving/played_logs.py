"""Logs as one source that is read by time: the messages between two moments, and the state at one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, NamedTuple, Self, final

from mcap.records import Channel, ChunkIndex, Schema

from recorders.foxglove.channels import LATCHED
from recorders.mcap_io.channels import ChannelSpec
from recorders.mcap_io.index import LogIndex
from replayers.mcap_io.messages import ChunkMessages, Message
from replayers.mcap_io.scan import Damage, open_log, record_at
from replayers.mcap_io.summary import has_counts, read_index
from workbench.errors import MalformedFile

OnDamage = Callable[[Path, Damage], None]


class PlayedMessage(NamedTuple):
    """A message with the channel under which it is shown."""

    channel: ChannelSpec
    data: bytes
    log_time: int


class NoIndex(MalformedFile):
    """A log that cannot be read by time."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            path, "it has no index to find times by", f"Write one: lios recover {path} -o {path.stem}-whole.mcap"
        )


@final
class PlayedLogs:
    """Several logs on one clock; a context manager. A topic that several logs hold gets the log's name before it.

    Args:
        on_damage: called for every chunk that cannot be read; the rest is played.

    Attributes:
        start_ns, end_ns: first and last log time of all of them.

    Raises:
        NoIndex: a log was cut off, or written without an index.
    """

    def __init__(self, paths: Sequence[Path], *, on_damage: OnDamage) -> None:
        self._open_files = ExitStack()
        try:
            self._logs = [
                _PlayedLog(path, self._open_files.enter_context(open_log(path)), on_damage) for path in paths
            ]
        except BaseException:
            self._open_files.close()
            raise
        _tell_apart(self._logs)
        spans = [(log.index.first_ns, log.index.last_ns) for log in self._logs if log.index.messages]
        self.start_ns = min((first for first, _ in spans), default=0)
        self.end_ns = max((last for _, last in spans), default=0)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open_files.close()

    def channels(self) -> Iterator[ChannelSpec]:
        """The channels that hold messages."""
        for log in self._logs:
            yield from log.shown.values()

    def between(self, after_ns: int, until_ns: int) -> list[PlayedMessage]:
        """Messages after one log time, up to and with another, in the order of their times."""
        found = [shown for log in self._logs for shown in log.between(after_ns, until_ns)]
        return sorted(found, key=lambda shown: shown.log_time)

    def standing_at(self, time_ns: int) -> list[PlayedMessage]:
        """The last message of every channel at or before a log time, in the order of their times."""
        found = [shown for log in self._logs for shown in log.standing_at(time_ns)]
        return sorted(found, key=lambda shown: shown.log_time)


@final
class _PlayedLog:
    def __init__(self, path: Path, stream: BinaryIO, on_damage: OnDamage) -> None:
        index = read_index(stream)
        if index is None or not has_counts(index) or not (index.chunks or not index.messages):
            raise NoIndex(path)
        self.path, self.index = path, index
        self._stream, self._on_damage = stream, on_damage
        self._last: tuple[int, list[Message]] = (-1, [])
        self.shown = {
            number: _spec(channel, index.schemas.get(channel.schema_id))
            for number, channel in sorted(index.channels.items())
            if index.counts.get(number)
        }

    def between(self, after_ns: int, until_ns: int) -> Iterator[PlayedMessage]:
        for chunk in _overlapping(self.index, after_ns + 1, until_ns):
            for message in self._messages(chunk):
                if after_ns < message.log_time <= until_ns:
                    yield from self._shown(message)

    def standing_at(self, time_ns: int) -> Iterator[PlayedMessage]:
        """From the last chunk backwards, as far as chunks can hold something later than what is known."""
        best: dict[int, Message] = {}
        chunks = [chunk for chunk in self.index.chunks if chunk.message_start_time <= time_ns]
        for chunk in sorted(chunks, key=lambda c: (c.message_end_time, c.chunk_start_offset), reverse=True):
            inside = self.shown.keys() & (chunk.message_index_offsets or self.shown).keys()
            latest = min(chunk.message_end_time, time_ns)
            if all(number in best and best[number].log_time >= latest for number in inside):
                continue
            for number, message in self._last_of_each(chunk, time_ns).items():
                if number not in best or message.log_time > best[number].log_time:
                    best[number] = message
        for message in best.values():
            yield from self._shown(message)

    def _last_of_each(self, chunk: ChunkIndex, time_ns: int) -> dict[int, Message]:
        last: dict[int, Message] = {}
        for message in self._messages(chunk):
            known = last.get(message.channel.id)
            if message.log_time <= time_ns and (known is None or message.log_time >= known.log_time):
                last[message.channel.id] = message
        return last

    def _shown(self, message: Message) -> Iterator[PlayedMessage]:
        spec = self.shown.get(message.channel.id)
        if spec is not None:
            yield PlayedMessage(spec, message.data, message.log_time)

    def _messages(self, chunk: ChunkIndex) -> list[Message]:
        """The messages of a chunk; the last one read is kept, as playing reads each many times."""
        offset = chunk.chunk_start_offset
        if self._last[0] != offset:
            content = ChunkMessages(on_damage=lambda damage: self._on_damage(self.path, damage))
            content.schemas, content.channels = dict(self.index.schemas), dict(self.index.channels)
            record = record_at(self._stream, offset, on_damage=content.report)
            self._last = offset, list(content.messages_of(offset, record))
        return self._last[1]


def _overlapping(index: LogIndex, first_ns: int, last_ns: int) -> list[ChunkIndex]:
    chunks = [c for c in index.chunks if c.message_end_time >= first_ns and c.message_start_time <= last_ns]
    return sorted(chunks, key=lambda chunk: chunk.chunk_start_offset)


def _spec(channel: Channel, schema: Schema | None) -> ChannelSpec:
    return ChannelSpec(
        topic=channel.topic,
        message_encoding=channel.message_encoding,
        schema_name="" if schema is None else schema.name,
        schema_encoding="" if schema is None else schema.encoding,
        schema_data=b"" if schema is None else schema.data,
        metadata=tuple(sorted(channel.metadata.items())),
        latched=channel.topic in LATCHED,
    )


def _tell_apart(logs: Iterable[_PlayedLog]) -> None:
    """Put the log's name before topics that several logs hold, and a number where logs have one name too."""
    logs = list(logs)
    names: list[str] = []
    for log in logs:
        name, number = log.path.stem, 2
        while name in names:
            name, number = f"{log.path.stem}-{number}", number + 1
        names.append(name)
    held = [{spec.topic for spec in log.shown.values()} for log in logs]
    for log, name in zip(logs, names, strict=True):
        for number, spec in log.shown.items():
            if sum(spec.topic in topics for topics in held) > 1:
                log.shown[number] = replace(spec, topic=f"/{name}/{spec.topic.lstrip('/')}")
