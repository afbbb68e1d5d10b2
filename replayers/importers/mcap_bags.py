"""Bags in MCAP, read by this package's own reader: any profile, chunked or not, with or without indexes, in order.

rosbags decodes the messages. Topics whose encoding or schema is none of ROS's, or cannot be parsed, are left
out, with the reason.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from heapq import heappop, heappush, merge
from pathlib import Path
from typing import Any, final

from replayers.mcap_io.messages import Message
from replayers.mcap_io.reader import messages
from workbench.caches import Cache

MAGIC = b"\x89MCAP0\r\n"
MAX_PROFILE_BYTES = 256
MAX_CACHED_KINDS = 1000
ENCODINGS = {"cdr": ("ros2msg", "ros2idl"), "ros1": ("ros1msg",)}
"""Schema encodings of ROS by message encoding, as in the MCAP registry."""

Raw = tuple[int, str, str, bytes]
"""Log time in nanoseconds, topic, message type, data."""


class CutOffMcap(Exception):
    """An MCAP file without its end, as a recorder that was killed leaves it."""


@final
@dataclass(slots=True)
class McapFiles:
    """MCAP files of one bag; opened by `open_mcap`.

    Attributes:
        profiles: the profiles that the files name.
        start_ns: the first log time.
        counts: messages by topic, of readable topics.
        skipped: why a topic is left out.
    """

    paths: tuple[Path, ...]
    default_store: Any
    profiles: set[str] = field(default_factory=set)
    start_ns: int = 0
    counts: dict[str, int] = field(default_factory=dict)
    skipped: dict[str, str] = field(default_factory=dict)
    _back_ns: dict[Path, int] = field(default_factory=dict)
    _kinds: Cache[tuple[str, bytes], tuple[str, Any] | str] = field(default_factory=lambda: Cache(MAX_CACHED_KINDS))
    _stores: dict[str, tuple[Any, bool]] = field(default_factory=dict)

    def raw(self, topics: tuple[str, ...]) -> Iterator[Raw]:
        """Undecoded messages of some topics in the order of their log times, of all files together."""
        wanted = frozenset(topics) - self.skipped.keys()
        streams = [self._ordered(path, wanted) for path in self.paths]
        yield from merge(*streams, key=lambda each: each[0])

    def decode(self, kind: str, data: bytes) -> Any:
        """A message of a type that `raw` gave."""
        store, ros1 = self._stores[kind]
        return store.deserialize_ros1(data, kind) if ros1 else store.deserialize_cdr(data, kind)

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
                if self._kind_of(message) is not None:
                    self.counts[message.topic] = self.counts.get(message.topic, 0) + 1
            self._back_ns[path] = back
        self.start_ns = first or 0

    def _ordered(self, path: Path, topics: frozenset[str]) -> Iterator[Raw]:
        """One file's messages in time order, holding back as many as the survey found out of order."""
        back_ns, number, newest = self._back_ns[path], 0, 0
        heap: list[tuple[int, int, Raw]] = []
        for message in messages(path):  # by the records, for an index may leave messages out
            kind = self._kind_of(message) if message.topic in topics else None
            if kind is None:
                continue
            number, newest = number + 1, max(newest, message.log_time)
            heappush(heap, (message.log_time, number, (message.log_time, message.topic, kind, message.data)))
            while heap and heap[0][0] <= newest - back_ns:
                yield heappop(heap)[2]
        while heap:
            yield heappop(heap)[2]

    def _kind_of(self, message: Message) -> str | None:
        """The message's type; None where it cannot be decoded, which is noted once a topic."""
        schema = message.schema
        key = (message.channel.message_encoding, b"" if schema is None else schema.name.encode() + schema.data)
        found = self._kinds.get(key, lambda: self._learn(message))
        if isinstance(found, str):
            self.skipped.setdefault(message.topic, found)
            return None
        return found[0]

    def _learn(self, message: Message) -> tuple[str, Any] | str:
        """The type of a message with what decodes it, or why nothing does."""
        schema, encoding = message.schema, message.channel.message_encoding
        if encoding not in ENCODINGS:
            return f"its messages are encoded as {encoding or 'nothing named'}, which is not ROS's"
        if schema is None:
            return "it has no schema"
        name = schema.name if "/msg/" in schema.name else schema.name.replace("/", "/msg/", 1)
        from rosbags.typesys import TypesysError

        try:
            store = self._store(name, schema.encoding, schema.data, ENCODINGS[encoding])
        except (TypesysError, ValueError, LookupError, AssertionError, TypeError, RecursionError) as error:
            reason = " ".join(str(error).split())[:120]
            return f"its schema {schema.name} cannot be parsed ({reason or type(error).__name__})"
        self._stores.setdefault(name, (store, encoding == "ros1"))
        return name, store

    def _store(self, name: str, encoding: str, data: bytes, known: Iterable[str]) -> Any:
        from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

        if not data and name in self.default_store.fielddefs:
            return self.default_store
        if encoding not in known:
            raise ValueError(f"schema encoding {encoding or 'not named'}")
        text = data.decode()
        store = get_typestore(Stores.EMPTY)
        if encoding != "ros2idl":
            store.register(get_types_from_msg(text, name))
            return store
        types: dict[str, Any] = {}
        for part in text.split("=" * 80 + "\n"):
            if part.strip():
                types.update(get_types_from_idl(part.split("\n", 1)[1] if part.startswith("IDL: ") else part))
        store.register(types)
        return store


def open_mcap(paths: tuple[Path, ...], default_store: Any) -> McapFiles:
    """The files of a bag, surveyed.

    Args:
        default_store: rosbags' store of types, for schemas without a text.

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
    files = McapFiles(paths, default_store)
    files.survey()
    return files


def _profile(path: Path) -> str:
    """The profile in a file's header record: "ros2", "ros1", "", or any other."""
    with path.open("rb") as stream:
        head = stream.read(len(MAGIC) + 9 + 4 + MAX_PROFILE_BYTES)[len(MAGIC) + 9 :]
    (size,) = struct.unpack("<I", head[:4]) if len(head) >= 4 else (0,)
    return head[4 : 4 + min(size, MAX_PROFILE_BYTES)].decode(errors="replace")
