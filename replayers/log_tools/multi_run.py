"""Several runs in one log: how they are marked, merged and taken apart again.

A file holds one run. Where `lios log merge --runs` puts several into one, every channel is marked with its run in its
metadata, and names of attachments and metadata records begin with "runs/NUMBER/". So two runs are never mistaken for
one, viewers show all of them, and `lios log split --by run` gives each back with its own map, task and settings.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from mcap.records import Attachment, Channel, Metadata

from recorders.mcap_io.file import part_path, remove_parts
from replayers.mcap_io.messages import Message
from replayers.mcap_io.reader import metadata
from workbench.errors import BadValue, MalformedFile
from workbench.log_schema.run_info import INFO_METADATA, PART_METADATA

if TYPE_CHECKING:
    from replayers.log_tools.copy_log import LogCopier, LogLayout, ReadLoss

RUN_KEY = "lios.member"
"""Channel metadata: the number of the run."""
_NAMED = re.compile(r"runs/(\d{1,6})/(.+)", re.DOTALL)

Part = Message | Attachment | Metadata
Progress = Callable[[Iterator[Message]], Iterable[Message]]


class LossRecord(Protocol):
    """What of a log is lost, gathered while it is read (recovered.SourceLoss)."""

    loss: ReadLoss

    def count(self, piece: Message) -> None:
        """Counts what has been read."""
        ...

    def take(self, record: Metadata) -> bool:
        """Whether a metadata record is about losses; it is then kept instead of being copied."""
        ...

    def records(self) -> list[tuple[str, dict[str, str]]]:
        """Name and values of the metadata records that a copy needs."""
        ...


class SeveralRuns(MalformedFile):
    """A log of several runs, where a log of one is needed."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            path, "it holds several runs", f"Split them first: lios log split {path} -o runs/run.mcap --by run"
        )


class NoRunInLog(MalformedFile):
    """An MCAP file that no run was recorded to."""

    def __init__(self, path: Path, lacks: str) -> None:
        self.lacks = lacks
        super().__init__(path, f"it holds no run (no {lacks})", "Give a log of lios record, or lios site from-log")


class AlreadySeveralRuns(BadValue):
    """A log to merge that is itself of several runs."""

    def __init__(self, path: Path) -> None:
        super().__init__("a log to merge", str(path), "a log of one run; split it first: lios log split --by run")


def member_name(name: str, run: int) -> str:
    """The name of a run's attachment or metadata record in a log of several runs."""
    return f"runs/{run}/{name}"


def run_and_name(name: str) -> tuple[int | None, str]:
    """The run of an attachment or metadata record and its name in that run; None for what belongs to no run."""
    found = _NAMED.fullmatch(name)
    return (int(found[1]), found[2]) if found else (None, name)


def run_of(channel: Channel) -> int | None:
    """The run of a channel in a log of several runs; None for what belongs to no run."""
    number = channel.metadata.get(RUN_KEY, "")
    return int(number) if number.isascii() and number.isdecimal() else None


def unmarked(part: Part) -> tuple[int | None, Part]:
    """The run of an item of a log of several runs, and the item as it is in the run's own log."""
    if isinstance(part, Message):
        number = run_of(part.channel)
        if number is None:
            return None, part
        rest = {key: value for key, value in part.channel.metadata.items() if key != RUN_KEY}
        return number, part._replace(channel=replace(part.channel, metadata=rest))
    run, name = run_and_name(part.name)
    return run, part if run is None else replace(part, name=name)


def runs_of(sources: Sequence[Path]) -> list[int]:
    """The number of each log's run, from 0; parts of one recording are one run.

    Raises:
        AlreadySeveralRuns: a log of several runs.
    """
    known: dict[tuple[tuple[str, str], ...], int] = {}
    numbers: list[int] = []
    count = 0
    for source in sources:
        if metadata(source, member_name(INFO_METADATA, 0)) is not None:
            raise AlreadySeveralRuns(source)
        info = tuple(sorted((metadata(source, INFO_METADATA) or {}).items()))
        is_part = bool(info) and metadata(source, PART_METADATA) is not None
        number = known.get(info, count) if is_part else count
        if is_part:
            known[info] = number
        count = max(count, number + 1)
        numbers.append(number)
    return numbers


@dataclass(slots=True)
class RunMarker:
    """Marks what one log gives to a log of several runs."""

    run: int
    _channels: dict[int, tuple[Channel, Channel]] = field(default_factory=dict)

    def message(self, message: Message) -> Message:
        channel = message.channel
        before, marked = self._channels.get(channel.id, (None, channel))
        if before is not channel:
            marked = replace(channel, metadata={**channel.metadata, RUN_KEY: str(self.run)})
            self._channels[channel.id] = channel, marked
        return message._replace(channel=marked)


def split_by_run(
    source: Path, output: Path, style: LogLayout, lost: LossRecord, progress: Progress = iter
) -> tuple[list[Path], int]:
    """One file a run, output_0000.mcap, ...: the files, and how many messages were read.

    What belongs to no run, such as later notes, goes to every run that has begun by then. A log of one run gives one
    file.
    """
    from replayers.log_tools.copy_log import profile_of

    taking = _RunFiles(output, style, profile_of(source))
    count = 0
    with taking.files:
        for message in progress(_messages(source, lost, taking)):
            taking.put(message)
            count += 1
        taking.tell(lost)
    remove_parts(output, beyond=len(taking.paths))
    return taking.paths, count


def _messages(source: Path, lost: LossRecord, taking: _RunFiles) -> Iterator[Message]:
    from replayers.log_tools.copy_log import contents

    for part in contents(source, lost.loss):
        if isinstance(part, Message):
            lost.count(part)
            yield part
        elif isinstance(part, Attachment) or (isinstance(part, Metadata) and not lost.take(part)):
            taking.put(part)


@dataclass(slots=True)
class _RunFiles:
    """The files of the runs, open together; each gets its final name at the end."""

    output: Path
    style: LogLayout
    profile: str
    files: ExitStack = field(default_factory=ExitStack)
    paths: list[Path] = field(default_factory=list)
    _copiers: dict[int, LogCopier] = field(default_factory=dict)
    _of_no_run: list[Attachment | Metadata] = field(default_factory=list)

    def put(self, part: Part) -> None:
        run, plain = unmarked(part)
        if run is None and not isinstance(plain, Message) and plain.name != INFO_METADATA:
            self._of_no_run.append(plain)
        elif run is not None or not self._copiers:
            run = run or 0
            if run not in self._copiers:
                self._open(run)
            _copy(self._copiers[run], plain)
            return
        for copier in self._copiers.values():
            _copy(copier, plain)

    def tell(self, lost: LossRecord) -> None:
        """Writes to each run's file what of it is lost."""
        for run, copier in self._copiers.items():
            for name, facts in lost.records():
                of, plain = run_and_name(name)
                if of is None or of == run:
                    copier.writer.add_metadata(plain, facts)

    def _open(self, run: int) -> None:
        from replayers.log_tools.copy_log import LogCopier

        path = part_path(self.output, len(self.paths))
        copier = self.files.enter_context(LogCopier(path, self.style, profile=self.profile))
        self._copiers[run] = copier
        self.paths.append(path)
        for part in self._of_no_run:
            _copy(copier, part)


def _copy(copier: LogCopier, part: Part) -> None:
    if isinstance(part, Message):
        copier.copy(part)
    elif isinstance(part, Attachment):
        copier.attach(part)
    else:
        copier.describe(part)
