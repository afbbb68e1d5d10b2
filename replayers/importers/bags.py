"""Reads ROS 1 bags (.bag) and ROS 2 bags (a folder, or one .mcap or .db3 file), message by message."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from replayers.importers.mcap_bags import CutOffMcap, McapFiles, open_mcap
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


class Unclosed(Malformed):
    """An MCAP file whose recorder was killed."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            f"{path}: cut off, as a killed recording is. "
            f"Run lios recover {path} -o {path.stem}_recovered.mcap, then import that file."
        )


class Packed(Malformed):
    """A compressed file of a bag without its folder's metadata.yaml."""

    def __init__(self, path: Path) -> None:
        plain = path.with_suffix("")
        super().__init__(
            f"{path}: compressed as a whole, and without its folder's metadata.yaml it cannot be read as it is. "
            f"Run zstd -d {path} (if it was cut off, then lios recover {plain}), then import {plain}."
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
    """An open bag.

    Attributes:
        skipped: topics that cannot be read, with the reason.
        profiles: profiles of MCAP files other than ROS's own.
    """

    path: Path
    reader: Any

    @property
    def topics(self) -> tuple[str, ...]:
        if isinstance(self.reader, McapFiles):
            return tuple(sorted({*self.reader.counts, *self.reader.skipped}))
        return tuple(sorted({connection.topic for connection in self.reader.connections}))

    @property
    def start_ns(self) -> int:
        return self.reader.start_ns if isinstance(self.reader, McapFiles) else int(self.reader.start_time)

    @property
    def counts(self) -> dict[str, int]:
        if isinstance(self.reader, McapFiles):
            return dict(sorted(self.reader.counts.items()))
        return {name: info.msgcount for name, info in sorted(self.reader.topics.items())}

    @property
    def skipped(self) -> dict[str, str]:
        return dict(sorted(self.reader.skipped.items())) if isinstance(self.reader, McapFiles) else {}

    @property
    def profiles(self) -> tuple[str, ...]:
        known = {"ros1", "ros2"}
        return tuple(sorted(self.reader.profiles - known)) if isinstance(self.reader, McapFiles) else ()

    def messages(self, topics: tuple[str, ...]) -> Iterator[BagMessage]:
        """The messages of some topics in the order of their record times, of all files of the bag together.

        Raises:
            UnknownMessageType: one of them has a type without a known definition.
            NotABag: the file is damaged.
        """
        from rosbags.highlevel import AnyReaderError
        from rosbags.serde import SerdeError

        try:
            if isinstance(self.reader, McapFiles):
                for stamp_ns, topic, kind, data in self.reader.raw(topics):
                    yield BagMessage(topic, kind, stamp_ns, self.reader.decode(kind, data))
            else:
                yield from self._by_rosbags(topics)
        except (AnyReaderError, SerdeError, OSError, ValueError, AssertionError, EOFError) as error:
            raise NotABag(self.path, f"damaged: {error}") from error

    def _by_rosbags(self, topics: tuple[str, ...]) -> Iterator[BagMessage]:
        chosen = [connection for connection in self.reader.connections if connection.topic in topics]
        for connection in chosen:
            if connection.msgtype not in self.reader.typestore.fielddefs:
                raise UnknownMessageType(self.path, connection.topic, connection.msgtype)
        if not chosen:
            return
        for connection, stamp_ns, raw in self.reader.messages(connections=chosen):
            message = self.reader.deserialize(raw, connection.msgtype)
            yield BagMessage(connection.topic, connection.msgtype, int(stamp_ns), message)


@contextmanager
def open_bag(path: Path) -> Generator[Bag]:
    """Opens a bag of ROS 1 or ROS 2.

    Raises:
        MissingExtra: rosbags is not installed. FileMissing, NotABag, EmptyBag, Unclosed, Packed.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
    except ImportError as error:
        raise MissingExtra("Importing bags", "bags") from error
    if not path.exists():
        raise FileMissing(path)
    if path.is_file() and path.suffix == ".zstd":
        raise Packed(path)
    if path.is_file() and path.suffix not in (".bag", *ROS2_SUFFIXES):
        raise NotABag(path, f"files of {path.suffix or 'no suffix'} are not known")
    files = _files(path)
    try:
        if files and files[0].suffix == ".mcap":
            yield _open_mcap(path, files)
            return
        # files of a folder are given one by one: rosbags merges by time only what it opens as several bags
        reader = AnyReader(list(files) if len(files) > 1 else [path], default_typestore=_definitions())
        reader.open()
    except CutOffMcap as error:
        raise Unclosed(Path(str(error))) from error
    except FileNotFoundError as error:
        raise NotABag(path, "a ROS 2 bag folder has a metadata.yaml; without it give its .db3 file") from error
    except (AnyReaderError, OSError, ValueError, AssertionError, KeyError, NotImplementedError) as error:
        raise NotABag(path, str(error) or type(error).__name__) from error
    try:
        if reader.message_count == 0:
            raise EmptyBag(path)
        yield Bag(path, reader)
    finally:
        reader.close()


def _files(path: Path) -> tuple[Path, ...]:
    """The data files of a ROS 2 bag, uncompressed, by name; none for what rosbags opens as a whole."""
    if path.is_file():
        return (path,) if path.suffix == ".mcap" else ()
    found = {suffix: tuple(sorted(path.glob(f"*{suffix}"))) for suffix in ROS2_SUFFIXES}
    packed = next(path.glob("*.zstd"), None)
    if packed is not None:
        if not (path / "metadata.yaml").exists():
            raise Packed(packed)
        return ()
    return found[".mcap"] or found[".db3"]


def _open_mcap(path: Path, files: tuple[Path, ...]) -> Bag:
    from workbench.log_schema.run_info import INFO_METADATA

    reader = open_mcap(files, _definitions())
    if not reader.counts and not reader.skipped:
        raise EmptyBag(path)
    if not reader.counts:
        from replayers.mcap_io.reader import metadata

        topic, reason = next(iter(sorted(reader.skipped.items())))
        own = metadata(files[0], INFO_METADATA) is not None
        named = f"profile {', '.join(repr(each) for each in sorted(reader.profiles))}"
        raise NotABag(
            path, "a log of this workbench already" if own else f"{named}: no topic is ROS's; {topic}: {reason}"
        )
    return Bag(path, reader)


def _definitions() -> Any:
    """ROS 2's own message types and a few more, for bags that carry none."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types: dict[str, Any] = {}
    for name, text in EXTRA_DEFINITIONS.items():
        types.update(get_types_from_msg(text, name))
    store.register(types)
    return store
