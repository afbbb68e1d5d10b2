"""Reads ROS 1 bags (.bag) and ROS 2 bags (a folder, or one .mcap or .db3 file) by rosbags, message by message."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.errors import FileMissing, Malformed, MissingExtra

ROS2_SUFFIXES = (".mcap", ".db3")

EXTRA_DEFINITIONS = {
    "apriltag_msgs/msg/Point": "float64 x\nfloat64 y\n",
    "apriltag_msgs/msg/AprilTagDetection": (
        "string family\nint32 id\nint32 hamming\nfloat32 goodness\nfloat32 decision_margin\n"
        "apriltag_msgs/Point centre\napriltag_msgs/Point[4] corners\nfloat64[9] homography\n"
    ),
    "apriltag_msgs/msg/AprilTagDetectionArray": (
        "std_msgs/Header header\napriltag_msgs/AprilTagDetection[] detections\n"
    ),
}
"""Definitions of types that SQLite bags do not carry and that are not part of ROS 2."""


class NotABag(Malformed):
    """A file or folder that is not a bag of ROS 1 or ROS 2."""

    def __init__(self, path: Path, reason: str) -> None:
        short = " ".join(reason.split())[:160].rstrip(".")
        super().__init__(
            f"{path}: not a bag that can be read ({short}). "
            "Give a ROS 1 .bag, a ROS 2 bag folder, or its .mcap or .db3."
        )


class EmptyBag(Malformed):
    """A bag without messages."""

    def __init__(self, path: Path) -> None:
        super().__init__(f"{path}: the bag holds no message. Record again, and check that topics were published.")


class UnknownMessageType(Malformed):
    """A mapped topic whose message type has no known definition."""

    def __init__(self, path: Path, topic: str, kind: str) -> None:
        super().__init__(
            f"{path}: topic {topic} has type {kind}, which the bag does not define and this release does not know. "
            "Record the bag as MCAP, which carries definitions, or leave the topic out of the mapping."
        )


@dataclass(frozen=True, slots=True)
class BagMessage:
    """A message with its topic, type and the time when it was recorded."""

    topic: str
    kind: str
    stamp_ns: int
    message: Any


@dataclass(frozen=True, slots=True)
class Bag:
    """An open bag."""

    path: Path
    reader: Any

    @property
    def topics(self) -> tuple[str, ...]:
        return tuple(sorted(connection.topic for connection in self.reader.connections))

    @property
    def start_ns(self) -> int:
        return int(self.reader.start_time)

    @property
    def counts(self) -> dict[str, int]:
        return {name: info.msgcount for name, info in sorted(self.reader.topics.items())}

    def messages(self, topics: tuple[str, ...]) -> Iterator[BagMessage]:
        """The messages of some topics in the order of their record times.

        Raises:
            UnknownMessageType: one of them has a type without a known definition.
            NotABag: the file is damaged.
        """
        from rosbags.highlevel import AnyReaderError

        chosen = [connection for connection in self.reader.connections if connection.topic in topics]
        for connection in chosen:
            if connection.msgtype not in self.reader.typestore.fielddefs:
                raise UnknownMessageType(self.path, connection.topic, connection.msgtype)
        if not chosen:
            return
        try:
            for connection, stamp_ns, raw in self.reader.messages(connections=chosen):
                message = self.reader.deserialize(raw, connection.msgtype)
                yield BagMessage(connection.topic, connection.msgtype, int(stamp_ns), message)
        except (AnyReaderError, OSError, ValueError, AssertionError, EOFError) as error:
            raise NotABag(self.path, f"damaged: {error}") from error


@contextmanager
def open_bag(path: Path) -> Generator[Bag]:
    """Opens a bag of ROS 1 or ROS 2.

    Raises:
        MissingExtra: rosbags is not installed. FileMissing, NotABag, EmptyBag.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
    except ImportError as error:
        raise MissingExtra("Importing bags", "bags") from error
    if not path.exists():
        raise FileMissing(path)
    if path.is_file() and path.suffix not in (".bag", *ROS2_SUFFIXES):
        raise NotABag(path, f"files of {path.suffix or 'no suffix'} are not known")
    try:
        reader = AnyReader([path], default_typestore=_definitions())
        reader.open()
    except FileNotFoundError as error:
        raise NotABag(path, "a ROS 2 bag folder has a metadata.yaml") from error
    except (AnyReaderError, OSError, ValueError, AssertionError, KeyError, NotImplementedError) as error:
        raise NotABag(path, str(error) or type(error).__name__) from error
    try:
        if reader.message_count == 0:
            raise EmptyBag(path)
        yield Bag(path, reader)
    finally:
        reader.close()


def _definitions() -> Any:
    """ROS 2's own message types and a few more, for bags that carry none."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types: dict[str, Any] = {}
    for name, text in EXTRA_DEFINITIONS.items():
        types.update(get_types_from_msg(text, name))
    store.register(types)
    return store
