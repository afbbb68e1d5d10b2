"""Message types of ROS by the definitions that a bag carries, and what decodes them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, final

from replayers.mcap_io.cdr import require_plain_cdr
from replayers.mcap_io.records import MAX_RECORD_BYTES, UnreadableRecord, unpacked
from workbench.caches import Cache
from workbench.message_enum import MessageEnum, Result

MAX_CACHED_KINDS = 1000
ENCODINGS: Mapping[str, tuple[str, ...]] = {"cdr": ("ros2msg", "ros2idl"), "ros1": ("ros1msg",)}
"""Schema encodings of ROS by message encoding, as in the MCAP registry."""


class TypeFinding(MessageEnum):
    """Whether messages of a type can be decoded, and if not, why."""

    KNOWN = ""
    NOT_ROS = "its messages are encoded as {encoding}, which is not ROS's"
    NO_SCHEMA = "it has no schema"
    UNDEFINED = "its type {kind} is defined neither in the bag nor in ROS 2"
    UNPARSED = "its schema {kind} cannot be parsed ({reason})"


@dataclass(frozen=True, slots=True, kw_only=True)
class Definition:
    """A type of messages as one file defines it; files recorded at other times may define the same name differently.

    Attributes:
        kind: as package/msg/Name.
        encoding: of the messages: cdr or ros1.
        schema_encoding: of the text: ros2msg, ros2idl or ros1msg.
        text: empty for a type that is known anyway.
    """

    kind: str
    encoding: str
    schema_encoding: str = ""
    text: bytes = b""


Raw = tuple[int, str, Definition, bytes]
"""A message: when it was recorded in nanoseconds, topic, type, data."""


@final
@dataclass(slots=True)
class MessageTypes:
    """The types of a bag's messages.

    Attributes:
        default_store: rosbags' store of types, for types without a definition.
        packed: each message is compressed by zstd.
    """

    default_store: Any
    packed: bool = False
    _known: Cache[Definition, Result[TypeFinding]] = field(default_factory=lambda: Cache(MAX_CACHED_KINDS))
    _stores: dict[Definition, Any] = field(default_factory=dict)

    def learn(self, definition: Definition) -> Result[TypeFinding]:
        """Learns a type of messages."""
        return self._known.get(definition, lambda: self._learn(definition))

    def decode(self, definition: Definition, data: bytes) -> Any:
        """A message of a type that was learnt.

        Raises:
            ValueError: it is compressed, and cannot be unpacked, or is not plain CDR. SerdeError: it is not of that
                type.
        """
        store, kind = self._stores[definition], definition.kind
        data = self._plain(data) if self.packed else data
        if definition.encoding == "ros1":
            return store.deserialize_ros1(data, kind)
        require_plain_cdr(data)
        return store.deserialize_cdr(data, kind)

    def _learn(self, definition: Definition) -> Result[TypeFinding]:
        from rosbags.typesys import TypesysError

        kind, encoding = definition.kind, definition.encoding
        if encoding not in ENCODINGS:
            return TypeFinding.NOT_ROS.result(encoding=encoding or "nothing named")
        if not definition.text and not definition.schema_encoding and kind not in self.default_store.fielddefs:
            return TypeFinding.UNDEFINED.result(kind=kind)
        try:
            self._stores[definition] = self._store(definition, ENCODINGS[encoding])
        except (TypesysError, ValueError, LookupError, AssertionError, TypeError, RecursionError) as error:
            reason = " ".join(str(error).split())[:120]
            return TypeFinding.UNPARSED.result(kind=kind, reason=reason or type(error).__name__)
        return TypeFinding.KNOWN.result()

    def _store(self, definition: Definition, known: Iterable[str]) -> Any:
        from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore

        encoding = definition.schema_encoding
        if not definition.text and definition.kind in self.default_store.fielddefs:
            return self.default_store
        if encoding not in known:
            raise ValueError(f"schema encoding {encoding or 'not named'}")
        text = definition.text.decode()
        store = get_typestore(Stores.EMPTY)
        if encoding != "ros2idl":
            store.register(get_types_from_msg(text, definition.kind))
            return store
        types: dict[str, Any] = {}
        for part in text.split("=" * 80 + "\n"):
            if part.strip():
                types.update(get_types_from_idl(part.split("\n", 1)[1] if part.startswith("IDL: ") else part))
        store.register(types)
        return store

    def _plain(self, data: bytes) -> bytes:
        try:
            plain = unpacked(data, "zstd", MAX_RECORD_BYTES)
        except UnreadableRecord as error:
            raise ValueError(f"a compressed message cannot be unpacked: {error}") from error
        if len(plain) > MAX_RECORD_BYTES:
            raise ValueError(f"a message unpacks to more than {MAX_RECORD_BYTES} bytes")
        return plain


def full_name(kind: str) -> str:
    """A type's name with its middle part: package/Name -> package/msg/Name."""
    return kind if kind.count("/") != 1 else kind.replace("/", "/msg/", 1)


@dataclass(slots=True, kw_only=True)
class SurveyedBag:
    """What the readers of a bag's files have in common.

    Attributes:
        profiles: the profiles that the files name; only MCAP files do.
        start_ns: the first time of recording.
        counts: messages by topic, of readable topics.
        skipped: why a topic is left out.
    """

    types: MessageTypes
    profiles: set[str] = field(default_factory=set)
    start_ns: int = 0
    counts: dict[str, int] = field(default_factory=dict)
    skipped: dict[str, str] = field(default_factory=dict)

    def decode(self, definition: Definition, data: bytes) -> Any:
        """A message of a type that `raw` gave."""
        return self.types.decode(definition, data)
