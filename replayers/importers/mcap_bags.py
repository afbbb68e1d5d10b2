"""Bags in MCAP, read by this package's own reader: any profile, chunked or not, with or without indexes, in order.

rosbags decodes the messages. Topics whose encoding or schema is none of ROS's, or cannot be parsed, are left
out, with the reason.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from heapq import heappop, heappush, merge
from pathlib import Path
from typing import final

from replayers.importers.message_types import (
    ENCODINGS,
    Definition,
    MessageTypes,
    Raw,
    SurveyedBag,
    TypeFinding,
    full_name,
)
from replayers.mcap_io.messages import Message
from replayers.mcap_io.reader import messages

MAGIC = b"\x89MCAP0\r\n"
MAX_PROFILE_BYTES = 256


class CutOffMcap(Exception):
    """An MCAP file without its end, as a recorder that was killed leaves it."""


@final
@dataclass(slots=True, kw_only=True)
class McapFiles(SurveyedBag):
    """MCAP files of one bag; opened by `open_mcap`."""

    paths: tuple[Path, ...]
    _back_ns: dict[Path, int] = field(default_factory=dict)

    def raw(self, topics: tuple[str, ...]) -> Iterator[Raw]:
        """Undecoded messages of some topics in the order of their log times, of all files together."""
        wanted = frozenset(topics) - self.skipped.keys()
        streams = [self._ordered(path, wanted) for path in self.paths]
        yield from merge(*streams, key=lambda each: each[0])

    def survey(self) -> None:
        """Reads every file once, undecoded: topics, counts, the start, and how far messages are out of order."""
        first: int | None = None
        for path in self.paths:
            self.profiles.add(_profile(path))
            newest, back = 0, 0
            for message in messages(path):
                newest = max(newest, message.log_time)
                back = max(back, newest - message.log_time)
                first = message.log_time if first is None else min(first, message.log_time)
                if self._type_of(message) is not None:
                    self.counts[message.topic] = self.counts.get(message.topic, 0) + 1
            self._back_ns[path] = back
        self.start_ns = first or 0

    def _ordered(self, path: Path, topics: frozenset[str]) -> Iterator[Raw]:
        """One file's messages in time order, holding back as many as the survey found out of order."""
        back_ns, number, newest = self._back_ns[path], 0, 0
        heap: list[tuple[int, int, Raw]] = []
        for message in messages(path):  # by the records, for an index may leave messages out
            known = self._type_of(message) if message.topic in topics else None
            if known is None:
                continue
            number, newest = number + 1, max(newest, message.log_time)
            heappush(heap, (message.log_time, number, (message.log_time, message.topic, known, message.data)))
            while heap and heap[0][0] <= newest - back_ns:
                yield heappop(heap)[2]
        while heap:
            yield heappop(heap)[2]

    def _type_of(self, message: Message) -> Definition | None:
        """The message's type; None where it cannot be decoded, which is noted once a topic."""
        schema, encoding = message.schema, message.channel.message_encoding
        definition = (
            Definition(kind="", encoding=encoding)
            if schema is None
            else Definition(
                kind=full_name(schema.name), encoding=encoding, schema_encoding=schema.encoding, text=schema.data
            )
        )
        no_schema = schema is None and encoding in ENCODINGS
        found = TypeFinding.NO_SCHEMA.result() if no_schema else self.types.learn(definition)
        if found.kind is TypeFinding.KNOWN:
            return definition
        self.skipped.setdefault(message.topic, found.message)
        return None


def open_mcap(paths: tuple[Path, ...], types: MessageTypes) -> McapFiles:
    """The files of a bag, surveyed.

    Args:
        types: what decodes its messages.

    Raises:
        CutOffMcap: a file has no end. OSError, ValueError: not MCAP.
    """
    for path in paths:
        with path.open("rb") as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise ValueError("it does not begin as MCAP does")
            stream.seek(-len(MAGIC), 2)
            if stream.read() != MAGIC:
                raise CutOffMcap(str(path))
    files = McapFiles(paths=paths, types=types)
    files.survey()
    return files


def _profile(path: Path) -> str:
    """The profile in a file's header record: "ros2", "ros1", "", or any other."""
    with path.open("rb") as stream:
        head = stream.read(len(MAGIC) + 9 + 4 + MAX_PROFILE_BYTES)[len(MAGIC) + 9 :]
    (size,) = struct.unpack("<I", head[:4]) if len(head) >= 4 else (0,)
    return head[4 : 4 + min(size, MAX_PROFILE_BYTES)].decode(errors="replace")
