"""Reads ROS 1 bags (.bag) and ROS 2 bags (a folder, or one .mcap or .db3 file), message by message.

Of a ROS 2 bag, metadata.yaml is asked only which files belong to it and whether its messages are compressed one by
one: all else is in the files. Messages are decoded by the definition that stands beside them.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import yaml
import zstandard

from replayers.importers.mcap_bags import CutOffMcap, McapFiles, open_mcap
from replayers.importers.message_types import Definition, MessageTypes, Raw
from replayers.importers.packed_files import Packed, unpack_file
from replayers.importers.ros1_bags import Ros1File, open_ros1
from replayers.importers.sqlite_bags import SqliteFiles, open_sqlite
from workbench.errors import FileMissing, Malformed, MissingExtra

ROS2_SUFFIXES = (".mcap", ".db3")
TRANSFORMS = "tf2_msgs/msg/TFMessage"
MAX_TOGETHER = 1000
"""Messages of one time that are held back at most, so that transforms among them come first."""
MAX_METADATA_BYTES = 1 << 20

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
"""Definitions of types that older SQLite bags do not carry and that are not part of ROS 2."""


class NotABag(Malformed):
    """A file or folder that is not a bag of ROS 1 or ROS 2."""

    def __init__(self, path: Path, reason: str) -> None:
        short = " ".join(reason.split())[:160].rstrip(".")
        super().__init__(
            f"{path}: not a bag that can be read ({short}). "
            "Give a ROS 1 .bag, a ROS 2 bag folder, or its .mcap or .db3."
        )


class BagNotClosed(Malformed):
    """An MCAP file whose recorder was killed."""

    def __init__(self, path: Path) -> None:
        plain, first = path, ""
        if path.suffix == ".zstd":
            plain, first = path.with_suffix(""), f"zstd -d {path}, then "
        super().__init__(
            f"{path}: cut off, as a killed recording is. "
            f"Run {first}lios recover {plain} -o {plain.stem}_recovered.mcap, then import that file."
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


class UndecodableTopic(Malformed):
    """A mapped topic with a message that is not what its type says."""

    def __init__(self, path: Path, topic: str, reason: str) -> None:
        short = " ".join(reason.split())[:160].rstrip(".")
        super().__init__(
            f"{path}: a message of {topic} cannot be decoded ({short}). "
            "Leave the topic out of the mapping, or record it again."
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
    reader: McapFiles | SqliteFiles | Ros1File

    @property
    def topics(self) -> tuple[str, ...]:
        return tuple(sorted({*self.reader.counts, *self.reader.skipped}))

    @property
    def start_ns(self) -> int:
        return self.reader.start_ns

    @property
    def counts(self) -> dict[str, int]:
        """Messages by topic."""
        return dict(sorted(self.reader.counts.items()))

    @property
    def undefined(self) -> dict[str, str]:
        """Topics of a type that is defined nowhere, with the type."""
        return self.reader.undefined if isinstance(self.reader, SqliteFiles) else {}

    @property
    def skipped(self) -> dict[str, str]:
        return dict(sorted(self.reader.skipped.items()))

    @property
    def profiles(self) -> tuple[str, ...]:
        known = {"ros1", "ros2"}
        return tuple(sorted(self.reader.profiles - known))

    def messages(self, topics: tuple[str, ...]) -> Iterator[BagMessage]:
        """The messages of some topics in the order of their record times, of all files of the bag together.

        Raises:
            UnknownMessageType: one of them has a type without a known definition.
            UndecodableTopic: a message of theirs is not what its type says.
            NotABag: the file is damaged.
        """
        from sqlite3 import Error as SqliteError

        from rosbags.rosbag1 import ReaderError

        for topic in sorted(self.undefined.keys() & set(topics)):
            raise UnknownMessageType(self.path, topic, self.undefined[topic])
        try:
            for stamp_ns, topic, definition, data in _transforms_first(self.reader.raw(topics)):
                yield BagMessage(topic, definition.kind, stamp_ns, self._decoded(topic, definition, data))
        except (ReaderError, SqliteError, OSError, ValueError, AssertionError, EOFError) as error:
            raise NotABag(self.path, f"damaged: {error}") from error

    def _decoded(self, topic: str, definition: Definition, data: bytes) -> Any:
        from rosbags.serde import SerdeError

        try:
            return self.reader.decode(definition, data)
        except (SerdeError, ValueError, KeyError) as error:
            raise UndecodableTopic(self.path, topic, str(error)) from error


def _transforms_first(found: Iterator[Raw]) -> Iterator[Raw]:
    """The same messages, with transforms before others of the same time: these may be placed by them."""
    together: list[Raw] = []
    for each in found:
        if together and (each[0] != together[0][0] or len(together) == MAX_TOGETHER):
            yield from sorted(together, key=lambda one: one[2].kind != TRANSFORMS)
            together = []
        together.append(each)
    yield from sorted(together, key=lambda one: one[2].kind != TRANSFORMS)


@contextmanager
def open_bag(path: Path) -> Generator[Bag]:
    """Opens a bag of ROS 1 or ROS 2.

    Raises:
        MissingExtra: rosbags is not installed. FileMissing, NotABag, EmptyBag, BagNotClosed, Packed,
            CutOffPacked, NoSpaceToUnpack.
    """
    try:
        from rosbags.rosbag1 import ReaderError
    except ImportError as error:
        raise MissingExtra("Importing bags", "bags") from error
    if not path.exists():
        raise FileMissing(path)
    if path.is_file() and path.suffix == ".zstd":
        raise Packed(path)
    if path.is_file() and path.suffix not in (".bag", *ROS2_SUFFIXES):
        raise NotABag(path, f"files of {path.suffix or 'no suffix'} are not known")
    with ExitStack() as stack:
        try:
            bag = _opened(path, stack)
        except CutOffMcap as error:
            file = Path(str(error))
            packed = path / f"{file.name}.zstd"
            raise BagNotClosed(file if file.parent == path or not packed.exists() else packed) from error
        except (
            ReaderError,
            OSError,
            ValueError,
            AssertionError,
            KeyError,
            NotImplementedError,
            zstandard.ZstdError,
        ) as error:
            raise NotABag(path, str(error) or type(error).__name__) from error
        yield bag


def _opened(path: Path, stack: ExitStack) -> Bag:
    if path.suffix == ".bag" and path.is_file():
        file = open_ros1(path, MessageTypes(_definitions()), stack)
        if not file.counts and not file.skipped:
            raise EmptyBag(path)
        return Bag(path, file)
    about = _metadata(path)
    files = _files(path, about, stack)
    types = MessageTypes(_definitions(), packed=str(about.get("compression_mode", "")).lower() == "message")
    if files[0].suffix == ".mcap":
        return _open_mcap(path, files, types)
    found = open_sqlite(files, types, stack)
    if not found.counts and not found.skipped:
        raise EmptyBag(path)
    return Bag(path, found)


def _metadata(path: Path) -> dict[str, Any]:
    """What a bag's metadata.yaml says of its files; empty where it is none or makes no sense."""
    file = (path if path.is_dir() else path.parent) / "metadata.yaml"
    try:
        with file.open(encoding="utf-8") as stream:
            found = yaml.safe_load(stream.read(MAX_METADATA_BYTES))
        about = found["rosbag2_bagfile_information"]
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError, RecursionError):
        return {}
    if not isinstance(about, dict) or not (path.is_dir() or path.name in _file_names(about)):
        return {}
    return about


def _file_names(about: dict[str, Any]) -> list[str]:
    """The names of the files that a bag's metadata list."""
    listed = about.get("relative_file_paths")
    return [Path(str(file)).name for file in listed] if isinstance(listed, list) else []


def _files(path: Path, about: dict[str, Any], stack: ExitStack) -> tuple[Path, ...]:
    """The data files of a ROS 2 bag: those that its metadata name, or else all of its folder; unpacked for a while
    where they are compressed.

    Raises:
        Packed, NotABag: compressed files without metadata; no data file.
        CutOffPacked, NoSpaceToUnpack: a compressed file that cannot be unpacked whole.
    """
    if path.is_file():
        return (path,)
    named = tuple(path / name for name in _file_names(about))
    if not named or not all(file.is_file() for file in named):
        suffixes = (".zstd", *ROS2_SUFFIXES)
        found = {suffix: tuple(sorted(path.glob(f"*{suffix}"))) for suffix in suffixes}
        if found[".zstd"] and not about:
            raise Packed(found[".zstd"][0])
        named = next((found[suffix] for suffix in suffixes if found[suffix]), ())
    if not named:
        raise NotABag(path, "a folder without .mcap and .db3 files")
    if named[0].suffix != ".zstd":
        return named
    folder = Path(stack.enter_context(TemporaryDirectory(prefix="lios-import-")))
    for file in named:
        unpack_file(file, folder / file.stem)
    return tuple(folder / file.stem for file in named)


def _open_mcap(path: Path, files: tuple[Path, ...], types: MessageTypes) -> Bag:
    from workbench.log_schema.run_info import INFO_METADATA

    reader = open_mcap(files, types)
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
