"""Filters, merges, splits and recompresses logs, streaming from the reader to the writer.

Messages, attachments and metadata of unknown topics pass through untouched.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from mcap.records import Attachment, Channel, Header, Metadata, Schema

from recorders.sinks.files import REPEATED
from replayers.log_tools.copy_log import LogCopier, LogLayout, Part, ReadLoss, pieces, profile_of
from replayers.log_tools.merge_order import by_time
from replayers.log_tools.multi_run import RunMarker, member_name, runs_of, split_by_run
from replayers.log_tools.recovered import SourceLoss, missing_parts, records_of
from replayers.log_tools.whole_chunk import WholeChunk
from replayers.mcap_io.messages import Message
from replayers.mcap_io.reader import wanted_chunks
from replayers.mcap_io.scan import open_log
from replayers.mcap_io.summary import indexed_messages, read_index
from workbench.errors import BadValue, Malformed
from workbench.log_schema.run_info import PART_METADATA

Piece = Message | WholeChunk
Progress = Callable[[Iterator[Any]], Iterable[Any]]
"""Wraps the messages, or whole chunks of them, as they are copied, for a progress bar."""


class Change(Protocol):
    """What is done to messages and attachments of some channels while they are copied."""

    def concerns(self, channel: Channel, schema: Schema | None) -> bool:
        """Whether messages of a channel may be changed."""
        ...

    def look(self, message: Message) -> None:
        """Sees a message before any is copied: how one is changed may depend on later ones."""
        ...

    def changed(self, message: Message) -> Message | None:
        """The message as it is to be copied; None to leave it out."""
        ...

    def keeps(self, attachment: Attachment) -> bool:
        """Whether an attachment is copied."""
        ...


class MixedRuns(Malformed):
    """Logs that disagree on something that one file can hold only once."""

    def __init__(self, name: str, path: Path) -> None:
        super().__init__(
            f"{path}: its {name} differs from that of the logs before it. "
            "Merge logs of one run, or give --runs for several, or --allow-duplicates."
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RewriteReport:
    """The result of rewriting logs.

    Attributes:
        dropped: messages that were not wanted.
        parts_missing: numbers of parts of a recording that were not among those that were joined.
    """

    outputs: tuple[Path, ...]
    messages: int
    dropped: int
    loss: ReadLoss
    parts_missing: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class MessageFilter:
    """Which messages are wanted.

    Attributes:
        include, exclude: topics must match one of include (if any) and none of exclude; whole names.
        start_ns, end_ns: log times, end exclusive.
    """

    include: tuple[re.Pattern[str], ...] = ()
    exclude: tuple[re.Pattern[str], ...] = ()
    start_ns: int = 0
    end_ns: int | None = None
    attachments: bool = True
    metadata: bool = True

    def topic(self, name: str) -> bool:
        included = not self.include or any(p.fullmatch(name) for p in self.include)
        return included and not any(p.fullmatch(name) for p in self.exclude)

    def time(self, log_time: int) -> bool:
        return self.start_ns <= log_time and (self.end_ns is None or log_time < self.end_ns)

    def message(self, message: Message) -> bool:
        return self.time(message.log_time) and self.topic(message.topic)


def patterns(texts: Iterable[str], option: str) -> tuple[re.Pattern[str], ...]:
    """Compiled topic expressions.

    Raises:
        BadValue: an invalid regular expression.
    """
    found: list[re.Pattern[str]] = []
    for text in texts:
        try:
            found.append(re.compile(text))
        except re.error as error:
            raise BadValue(option, text, f"a regular expression ({error})") from None
    return tuple(found)


def filtered(
    source: Path,
    output: Path,
    wanted: MessageFilter,
    style: LogLayout,
    progress: Progress = iter,
    *,
    change: Change | None = None,
) -> RewriteReport:
    """Copies the wanted messages of a log: whole chunks as they stand where the layout allows it and all is wanted.

    Chunks that, by the index, hold nothing that is wanted are not read.

    Args:
        change: what is done to wanted messages on the way.
    """
    loss, kept = ReadLoss(), 0
    require_distinct_output([source], output)
    jumps, dropped = _unwanted_chunks(source, wanted)
    lost = SourceLoss(name=source.name, loss=loss)
    with LogCopier(output, style, profile=profile_of(source)) as copier:
        if change is not None:
            _look_through(progress(pieces(source, ReadLoss(), jumps=jumps)), wanted, change)
        for piece in progress(_stream_pieces(pieces(source, loss, jumps=jumps), copier, wanted, change, lost)):
            size = len(piece.places) if isinstance(piece, WholeChunk) else 1
            taken = _copy_wanted(piece, copier, wanted, change)
            kept, dropped = kept + taken, dropped + size - taken
        for name, facts in lost.records() if wanted.metadata else ():
            copier.writer.add_metadata(name, facts)
    return RewriteReport(outputs=(output,), messages=kept, dropped=dropped, loss=loss)


def _look_through(found: Iterable[Part | WholeChunk], wanted: MessageFilter, change: Change) -> None:
    """Shows a change every wanted message that it concerns."""
    for part in found:
        messages: Iterable[Message] = ()
        if isinstance(part, Message):
            messages = [part] if wanted.message(part) else ()
        elif isinstance(part, WholeChunk) and any(change.concerns(*pair) for pair in part.channels.values()):
            messages = part.messages(lambda topic, log_time: wanted.topic(topic) and wanted.time(log_time))
        for message in messages:
            if change.concerns(message.channel, message.schema):
                change.look(message)


def _stream_pieces(
    found: Iterator[Part | WholeChunk],
    copier: LogCopier,
    wanted: MessageFilter,
    change: Change | None,
    lost: SourceLoss,
) -> Iterator[Piece]:
    """The messages and chunks of a log; its wanted attachments and metadata are copied as they are read."""
    for part in found:
        if isinstance(part, Message | WholeChunk):
            lost.count(part)
            yield part
        elif isinstance(part, Attachment) and wanted.attachments:
            if change is None or change.keeps(part):
                copier.attach(part)
        elif isinstance(part, Metadata) and wanted.metadata and not lost.take(part):
            copier.describe(part)


def _copy_wanted(piece: Piece, copier: LogCopier, wanted: MessageFilter, change: Change | None) -> int:
    """Copies what is wanted; returns how many messages it is."""
    if isinstance(piece, Message):
        return _copy_changed(piece, copier, change) if wanted.message(piece) else 0
    topics = {channel.topic: wanted.topic(channel.topic) for channel, _ in piece.channels.values()}
    whole = change is None or not any(change.concerns(*pair) for pair in piece.channels.values())
    if whole and all(topics.values()) and wanted.time(piece.start_ns) and wanted.time(piece.end_ns):
        return copier.copy_piece(piece)
    messages = piece.messages(lambda topic, log_time: topics[topic] and wanted.time(log_time))
    if whole:
        count, incompressible = 0, piece.stored is not None
        for count, message in enumerate(messages, start=1):  # noqa: B007 - the number of the last one
            copier.copy(message, incompressible=incompressible)
        return count
    return sum(_copy_changed(message, copier, change) for message in messages)


def _copy_changed(message: Message, copier: LogCopier, change: Change | None) -> int:
    if change is not None and change.concerns(message.channel, message.schema):
        changed = change.changed(message)
        if changed is None:
            return 0
        message = changed
    copier.copy(message)
    return 1


def _unwanted_chunks(source: Path, wanted: MessageFilter) -> tuple[dict[int, int], int]:
    """Start and end of the chunks that hold nothing that is wanted, by the index, and how many messages they hold.

    Chunks whose messages the index does not count are not among them.
    """
    with open_log(source) as stream:
        index = read_index(stream)
    if index is None:
        return {}, 0
    needed = set(wanted_chunks(index, wanted.topic, start_ns=wanted.start_ns, end_ns=wanted.end_ns))
    jumps, count = dict[int, int](), 0
    for chunk in index.chunks:
        held = indexed_messages(chunk)
        if chunk.chunk_start_offset not in needed and held is not None:
            end = chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length
            jumps[chunk.chunk_start_offset] = end
            count += held
    return jumps, count


def merge_logs(
    sources: Sequence[Path],
    output: Path,
    style: LogLayout,
    *,
    several_runs: bool = False,
    allow_duplicates: bool = False,
    progress: Progress = iter,
) -> RewriteReport:
    """Merges several logs into one, by log time. Equal attachments, metadata and channels become one.

    Parts of a split log become the original log again: what later parts only repeat is left out. Messages that two
    logs both hold, as recordings that overlap do, become one.

    Args:
        several_runs: each log is a run, or a part of one, and stays distinguishable from the others.

    Raises:
        MixedRuns: metadata or attachments of one name that differ, without allow_duplicates.
        BadValue: a log is given twice.
    """
    require_distinct_output(sources, output)
    _each_once(sources)
    count, missing = 0, set[int]()
    runs = runs_of(sources) if several_runs else [None] * len(sources)
    lost = [SourceLoss(name=source.name, loss=ReadLoss()) for source in sources]
    with LogCopier(output, style, profile=_common_profile(sources)) as copier:
        arounds = {run: _AttachmentCopier(copier, allow_duplicates, run) for run in runs}
        copier.reserve(sources)
        of_first = arounds[runs[0]]
        given = zip(sources, lost, runs, strict=True)
        flows = [_flow_of(source, of_source, arounds[run]) for source, of_source, run in given]
        for piece in progress(by_time(flows, on_repeated=of_first.count_repeated)):
            count += copier.copy_piece(piece)
        for run in arounds:
            of_run = [one for one, its in zip(lost, runs, strict=True) if its == run]
            missing |= set(missing_parts(of_run))
            for name, facts in records_of(of_run, joined=True):
                copier.writer.add_metadata(name if run is None else member_name(name, run), facts)
    return RewriteReport(
        outputs=(output,),
        messages=count,
        dropped=sum(around.repeated for around in arounds.values()),
        loss=ReadLoss.sum(one.loss for one in lost),
        parts_missing=tuple(sorted(missing)),
    )


def split_log(
    source: Path,
    output: Path,
    style: LogLayout,
    *,
    part_s: float | None = None,
    part_bytes: int | None = None,
    by_run: bool = False,
    progress: Progress = iter,
) -> RewriteReport:
    """Splits a log into parts, each of which opens alone: output_0000.mcap, output_0001.mcap, ...

    With force, the surplus parts of an earlier, longer split of that name are removed.

    Raises:
        BadValue: not exactly one way of splitting was given, or the log has the name of one of its own parts.
    """
    from replayers.log_tools.split import LogSplitter

    if re.fullmatch(re.escape(output.stem) + r"_[0-9]{4,}", source.stem):
        require_distinct_output([source], output.with_name(source.name))

    loss, count = ReadLoss(), 0
    if by_run:
        if part_s is not None or part_bytes is not None:
            raise BadValue("which of --by run, --every and --size", "several", "one")
        paths, count = split_by_run(source, output, style, SourceLoss(name=source.name, loss=loss), progress)
        return RewriteReport(outputs=tuple(paths), messages=count, dropped=0, loss=loss)
    with LogSplitter(source, output, style, part_s=part_s, part_bytes=part_bytes) as parts:
        for message in progress(parts.messages(loss)):
            parts.copy(message)
            count += 1
    return RewriteReport(outputs=tuple(parts.paths), messages=count, dropped=0, loss=loss)


@dataclass(slots=True)
class _AttachmentCopier:
    """Attachments and metadata of several logs as they are copied into one."""

    copier: LogCopier
    allow_duplicates: bool
    run: int | None
    seen: dict[tuple[str, str], set[bytes]] = field(default_factory=dict)
    repeated: int = 0

    def count_repeated(self) -> None:
        """Counts a message that another log gave already."""
        self.repeated += 1

    def take(self, part: Attachment | Metadata, path: Path) -> None:
        if part.name == PART_METADATA:
            return
        kind = type(part).__name__.lower()
        content = part.data if isinstance(part, Attachment) else repr(sorted(part.metadata.items())).encode()
        known = self.seen.setdefault((kind, part.name), set())
        if content in known:
            return
        if known and not self.allow_duplicates:
            raise MixedRuns(f"{kind} {part.name}", path)
        known.add(content)
        if self.run is not None:
            part = replace(part, name=member_name(part.name, self.run))
        if isinstance(part, Attachment):
            self.copier.attach(part)
        else:
            self.copier.describe(part)


def _flow_of(source: Path, lost: SourceLoss, around: _AttachmentCopier) -> Iterator[Piece]:
    """What of a log's messages goes into a merged one; attachments and metadata are copied as they are read."""
    key, value = REPEATED
    marks = None if around.run is None else RunMarker(around.run)
    for part in pieces(source, lost.loss):
        if isinstance(part, Message | WholeChunk):
            lost.count(part)
        if isinstance(part, WholeChunk):
            if marks is None and not any(c.metadata.get(key) == value for c, _ in part.channels.values()):
                yield part
                continue
            messages = part.messages()
        elif isinstance(part, Message):
            messages = iter((part,))
        else:
            tells_of_losses = isinstance(part, Metadata) and lost.take(part)
            if not tells_of_losses and not isinstance(part, Header):
                around.take(part, source)
            continue
        for message in messages:
            if message.channel.metadata.get(key) == value:
                around.repeated += 1
            else:
                yield marks.message(message) if marks else message


def require_distinct_output(sources: Sequence[Path], output: Path) -> None:
    """Refuses to write to a file that is being read.

    Raises:
        BadValue: the output is one of the sources.
    """
    for source in sources:
        if output.exists() and source.exists() and output.samefile(source):
            raise BadValue("output", str(output), "another file than what is read")


def _each_once(sources: Sequence[Path]) -> None:
    known: set[Path] = set()
    for source in sources:
        if source.resolve() in known:
            raise BadValue("a log to merge", str(source), "given once")
        known.add(source.resolve())


def _common_profile(sources: Sequence[Path]) -> str:
    profiles = {profile_of(source) for source in sources}
    return profiles.pop() if len(profiles) == 1 else ""
