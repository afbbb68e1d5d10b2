"""Notes of people on a run: Foxglove events on /notes, appended to a closed log.

Only the summary of the log is rewritten; every byte before it stays where it was.
"""

from __future__ import annotations

import io
import time
from dataclasses import dataclass
from pathlib import Path

from foxglove_schemas_protobuf.Event_pb2 import Event
from foxglove_schemas_protobuf.KeyValuePair_pb2 import KeyValuePair
from google.protobuf.message import DecodeError
from google.protobuf.timestamp_pb2 import Timestamp

from recorders.mcap_io.channels import protobuf_channel
from recorders.mcap_io.file import LogInUse
from recorders.mcap_io.index import LogIndex
from recorders.mcap_io.writer import McapWriter
from replayers.log_tools.info import describe
from replayers.log_tools.time_argument import moment
from replayers.mcap_io.messages import Message
from replayers.mcap_io.reader import messages
from replayers.mcap_io.scan import open_log
from replayers.mcap_io.summary import has_counts, is_closed, read_index
from workbench.errors import BadValue, Malformed
from workbench.log_schema.codec import UndecodableMessage
from workbench.log_schema.corrections import NOTE_TOPIC, Correction, correction_from
from workbench.log_schema.events import NANO
from workbench.remote.errors import LocalFileRequired
from workbench.remote.path import RemotePath, path_of

TRIES, WAIT_S = 20, 0.05


class NotClosed(Malformed):
    """A log without an index: still being recorded, or cut off."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            f"{path}: it is still being recorded, or was cut off. Make its index first: lios recover {path}"
        )


class IncompleteIndex(Malformed):
    """A closed log whose index does not list everything: one more chunk in it would hide the others from readers."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            f"{path}: its index does not hold everything, and a note there would hide messages from other readers. "
            f"Copy it with a whole index first: lios log compact {path} -o FILE"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RunNote:
    """A note of a person on a run.

    Attributes:
        start_ns, end_ns: the time span that it is about, in nanoseconds since the epoch.
        written_ns: when it was written, in nanoseconds since the epoch; 0 where unknown.
        seen: the correction that it makes; None for words alone.
    """

    text: str
    start_ns: int
    end_ns: int
    author: str = ""
    written_ns: int = 0
    seen: Correction | None = None


def add_note(
    path: Path | str,
    text: str,
    *,
    at: str = "",
    until: str = "",
    author: str = "",
    seen: Correction | None = None,
    now_ns: int | None = None,
) -> RunNote:
    """Adds a note to a closed log.

    Args:
        at, until: as replayers.log_tools.time_argument.moment reads them; by default the log's end, and the
            same moment.
        seen: a correction of the run (replayers.runs.correcting); the note is about its moment, and `at` is not used.
        now_ns: when the note is written.

    Raises:
        NotClosed: the log has no end yet.
        IncompleteIndex: its index does not list everything.
        LogInUse: another process has been writing to it for longer than a note takes.
        CannotCreate: there is no permission to write to it.
        DiskFull: no space is left; the log is unchanged.
        LocalFileRequired: it is at an address; such files are not changed.
        BadValue: an empty text, an invalid time, or one outside the log.
    """
    path = path_of(path)
    if isinstance(path, RemotePath):
        raise LocalFileRequired("the log", path)
    if not text.strip():
        raise BadValue("the note", text or None, "some words")
    for _ in range(TRIES):
        try:
            return _added(path, text, at=at, until=until, author=author, seen=seen, now_ns=now_ns)
        except (LogInUse, NotClosed):
            time.sleep(WAIT_S)  # another process's note takes milliseconds
    return _added(path, text, at=at, until=until, author=author, seen=seen, now_ns=now_ns)


def _added(
    path: Path, text: str, *, at: str, until: str, author: str, seen: Correction | None, now_ns: int | None
) -> RunNote:
    index, size = _index_of(path)
    start_ns = seen.stamp_ns if seen else _within(path, index, at, "--at") if at else index.last_ns
    end_ns = _within(path, index, until, "--until") if until else start_ns
    if end_ns < start_ns:
        raise BadValue("--until", until, "at or after --at")
    note = RunNote(
        text=text,
        start_ns=start_ns,
        end_ns=end_ns,
        author=author,
        written_ns=time.time_ns() if now_ns is None else now_ns,
        seen=seen,
    )
    spec = protobuf_channel(NOTE_TOPIC, Event)
    with McapWriter.append_to(path, index, size=size) as writer:
        known = [c.id for c in index.channels.values() if c.topic == NOTE_TOPIC and c.message_encoding == "protobuf"]
        if known:
            channel = known[0]
        else:
            schema = writer.add_schema(spec.schema_name, spec.schema_encoding, spec.schema_data)
            channel = writer.add_channel(spec.topic, spec.message_encoding, schema)
        writer.add_message(channel, _encoded(note), log_time=note.start_ns, publish_time=note.written_ns)
    return note


def notes_of(path: Path | str) -> list[RunNote]:
    """All notes of a log, ordered by the time that they are about.

    Raises:
        UndecodableMessage: a message on their topic that is not a note.
    """
    found = [note_from(message) for message in messages(path, topics=NOTE_TOPIC.__eq__)]
    return sorted(found, key=lambda note: (note.start_ns, note.written_ns))


def note_from(message: Message) -> RunNote:
    """The note in a message of its topic.

    Raises:
        UndecodableMessage: it is none.
    """
    try:
        event = Event.FromString(message.data)
    except DecodeError as error:
        raise UndecodableMessage(NOTE_TOPIC, str(error)) from error
    pairs = {pair.key: pair.value for pair in event.metadata}
    return RunNote(
        text=pairs.get("note", ""),
        start_ns=_ns(event.start_time),
        end_ns=_ns(event.end_time),
        author=pairs.get("author", ""),
        written_ns=message.publish_time,
        seen=correction_from(pairs, stamp_ns=_ns(event.start_time)),
    )


def _index_of(path: Path) -> tuple[LogIndex, int]:
    """A closed log's index, and the size of its file in bytes."""
    with open_log(path) as stream:
        size = stream.seek(0, io.SEEK_END)
        index = read_index(stream)
        closed = is_closed(stream) and stream.seek(0, io.SEEK_END) == size  # else somebody is writing
    if not closed:
        raise NotClosed(path)
    if index is None or not has_counts(index) or any(not chunk.message_index_offsets for chunk in index.chunks):
        raise IncompleteIndex(path)
    return index, size


def _within(path: Path, index: LogIndex, text: str, option: str) -> int:
    """A moment within the log: a note far from it would stretch the time span of the log."""
    origin_ns = describe(path).origin.stamp_ns
    stamp_ns = moment(text, start_ns=origin_ns, option=option)
    if index.messages and not index.first_ns <= stamp_ns <= index.last_ns:
        raise BadValue(option, text, f"within the log, 0 to {(index.last_ns - origin_ns) / NANO:.3f} seconds")
    return stamp_ns


def _encoded(note: RunNote) -> bytes:
    pairs = [KeyValuePair(key="note", value=note.text)]
    if note.author:
        pairs.append(KeyValuePair(key="author", value=note.author))
    if note.seen is not None:
        pairs += [KeyValuePair(key=key, value=value) for key, value in note.seen.as_pairs().items()]
    event = Event(start_time=_stamp(note.start_ns), end_time=_stamp(note.end_ns), metadata=pairs)
    return event.SerializeToString(deterministic=True)


def _stamp(ns: int) -> Timestamp:
    return Timestamp(seconds=ns // NANO, nanos=ns % NANO)


def _ns(stamp: Timestamp) -> int:
    return stamp.seconds * NANO + stamp.nanos
