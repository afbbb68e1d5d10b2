"""Splits a log into parts that each open alone: attachments, metadata and latched topics are repeated in each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self, final

from mcap.records import Attachment, Channel, Metadata

from recorders.foxglove.channels import LATCHED
from recorders.mcap_io.file import part_path, remove_parts
from recorders.sinks.files import REPEATED
from replayers.log_tools.copy_log import ChannelKey, LogCopier, LogLayout, ReadLoss, channel_key, contents, profile_of
from replayers.log_tools.log_paths import shown
from replayers.log_tools.multi_run import run_of
from replayers.log_tools.recovered import EVIDENCE_TOPICS, SourceLoss
from replayers.mcap_io.messages import Message
from workbench.errors import BadValue
from workbench.log_schema.events import NANO
from workbench.log_schema.run_info import PART_METADATA

STANDING_TOPICS = (*LATCHED, "/tf_static", "/search/truth")
"""Latched topics: their last message is repeated at the start of every part."""


@final
class LogSplitter:
    """Writes messages to one part after another; a context manager. All parts get their final names at the end."""

    def __init__(
        self, source: Path, output: Path, style: LogLayout, *, part_s: float | None, part_bytes: int | None
    ) -> None:
        if (part_s is None) == (part_bytes is None):
            given = "neither" if part_s is None else "both"
            raise BadValue("which of --every and --size", given, "one: seconds, or bytes, a part; or --by run")
        if part_s is not None and part_s <= 0:
            raise BadValue("--every", part_s, "more than 0 seconds")
        if part_bytes is not None and part_bytes < 1:
            raise BadValue("--size", part_bytes, "more than 0 bytes")
        self._source, self._output, self._style = source, output, style
        self._part_ns = None if part_s is None else round(part_s * NANO)
        self._part_bytes = part_bytes
        self._profile = profile_of(source)
        self._around: list[Attachment | Metadata] = []
        self._standing: dict[ChannelKey, Message] = {}
        self._first_ns: int | None = None
        self.paths: list[Path] = []
        self._finished: list[LogCopier] = []
        self._counts: dict[int | None, Counter[str]] = {}
        self._copier = self._open()

    def messages(self, loss: ReadLoss) -> Iterator[Message]:
        """The messages of the source; attachments and metadata go to every part, what is lost to the last one."""
        lost = SourceLoss(name=self._source.name, loss=loss)
        for part in contents(self._source, loss):
            if isinstance(part, Message):
                lost.count(part)
                yield part
            elif isinstance(part, Attachment) or (isinstance(part, Metadata) and not lost.take(part)):
                self._around.append(part)
                self._put(part)
        for name, facts in lost.records_of_last_part(self._counts):
            self._copier.writer.add_metadata(name, facts)

    def copy(self, message: Message) -> None:
        if self._is_full(message.log_time):
            self._next(message.log_time)
        if self._first_ns is None:
            self._first_ns = message.log_time
        self._copier.copy(message)
        if message.topic in EVIDENCE_TOPICS:
            self._counts.setdefault(run_of(message.channel), Counter())[message.topic] += 1
        if message.topic in STANDING_TOPICS:
            self._standing[channel_key(message.channel, message.schema)] = message

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with ExitStack() as stack:
            for copier in reversed(self._finished):
                stack.push(copier)
            stack.push(self._copier)
            if error is not None:
                raise error
        remove_parts(self._output, beyond=len(self.paths))

    def _is_full(self, log_time: int) -> bool:
        if self._first_ns is None:
            return False
        if self._part_ns is not None:
            return log_time - self._first_ns >= self._part_ns
        writer = self._copier.writer
        return writer.bytes_written + writer.bytes_in_hand >= (self._part_bytes or 0)

    def _next(self, log_time: int) -> None:
        self._copier.finish()
        self._finished.append(self._copier)
        self._copier = self._open()
        self._first_ns, self._counts = None, {}
        for part in self._around:
            self._put(part)
        for message in self._standing.values():
            again = _repeating(message.channel)
            self._copier.copy(message._replace(channel=again, log_time=log_time))

    def _put(self, part: Attachment | Metadata) -> None:
        if isinstance(part, Attachment):
            self._copier.attach(part)
        elif part.name != PART_METADATA:
            self._copier.describe(part)

    def _open(self) -> LogCopier:
        path = part_path(self._output, len(self.paths))
        copier = LogCopier(path, self._style, profile=self._profile)
        before = shown(self.paths[-1].name) if self.paths else ""
        copier.writer.add_metadata(PART_METADATA, {"part": str(len(self.paths)), "before": before})
        self.paths.append(path)
        return copier


def _repeating(channel: Channel) -> Channel:
    key, value = REPEATED
    return Channel(
        id=channel.id,
        topic=channel.topic,
        message_encoding=channel.message_encoding,
        metadata={**channel.metadata, key: value},
        schema_id=channel.schema_id,
    )
