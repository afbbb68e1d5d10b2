"""Reads a log: its messages, streaming, and its attachments and metadata by name.

Everything here uses the index of a closed log, and reads one that was cut off up to its last flush.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, DataEnd, McapRecord, Metadata

from recorders.mcap_io.index import LogIndex
from replayers.mcap_io.messages import ChunkMessages, Message
from replayers.mcap_io.scan import OnDamage, open_log, record_at, scan
from replayers.mcap_io.summary import read_index

NO_DATA = frozenset({int(Opcode.MESSAGE_INDEX), int(Opcode.ATTACHMENT), int(Opcode.METADATA)})
"""Records without messages; skipped unread when only messages are wanted."""


def messages(
    path: Path | str,
    *,
    topics: Callable[[str], bool] | None = None,
    start_ns: int = 0,
    end_ns: int | None = None,
    on_damage: OnDamage | None = None,
) -> Iterator[Message]:
    """Messages in the order of the file, streaming: one chunk in memory.

    A log that is cut off or damaged gives all that is intact; on_damage is called for the rest.

    Args:
        topics: which topics are wanted; all if not given.
        start_ns: the first wanted log time, in nanoseconds since the epoch.
        end_ns: the first log time after it that is not wanted; None for no end.
        on_damage: called for what cannot be read.
    """
    with open_log(path) as stream:
        content = ChunkMessages(on_damage=on_damage, topics=topics, start_ns=start_ns, end_ns=end_ns)
        index = None if topics is None and end_ns is None and not start_ns else read_index(stream)
        if index is None:
            for offset, record in scan(stream, path=path, on_damage=content.report, skip=NO_DATA):
                if isinstance(record, DataEnd):
                    return
                yield from content.messages_of(offset, record)
        else:
            content.schemas, content.channels = index.schemas, index.channels
            for offset in wanted_chunks(index, topics, start_ns=start_ns, end_ns=end_ns):
                yield from content.messages_of(offset, record_at(stream, offset, on_damage=content.report))


def wanted_chunks(
    index: LogIndex,
    topics: Callable[[str], bool] | None = None,
    *,
    start_ns: int = 0,
    end_ns: int | None = None,
) -> list[int]:
    """Offsets of the chunks that may hold wanted messages, in the order of the file."""
    wanted = {c.id for c in index.channels.values() if topics is None or topics(c.topic)}
    return sorted(
        chunk.chunk_start_offset
        for chunk in index.chunks
        if chunk.message_end_time >= start_ns
        and (end_ns is None or chunk.message_start_time < end_ns)
        and (not chunk.message_index_offsets or not wanted.isdisjoint(chunk.message_index_offsets))
    )


def attachment(path: Path | str, name: str) -> bytes | None:
    """The last attachment of that name, or None; found by the index where there is one."""
    return next((a.data for a in _outside_chunks(path, Attachment, name) if isinstance(a, Attachment)), None)


def metadata(path: Path | str, name: str) -> dict[str, str] | None:
    """The last metadata record of that name, or None; found by the index where there is one."""
    return next((m.metadata for m in _outside_chunks(path, Metadata, name) if isinstance(m, Metadata)), None)


def _outside_chunks(path: Path | str, kind: type[McapRecord], name: str) -> Iterator[McapRecord]:
    with open_log(path) as stream:
        index = read_index(stream)
        if index is not None:
            entries = index.attachments if kind is Attachment else index.metadata
            found = [record_at(stream, e.offset) for e in entries if e.name == name]
        else:
            unread = frozenset({int(Opcode.CHUNK), int(Opcode.MESSAGE_INDEX)})
            walk = scan(stream, path=path, on_damage=lambda damage: None, skip=unread)
            found = [record for _, record in walk]
    for record in reversed(found):
        if isinstance(record, kind) and getattr(record, "name", None) == name:
            yield record
