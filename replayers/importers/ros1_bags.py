"""Bags of ROS 1, read by rosbags; each connection's messages are decoded by the definition that it carries itself.

A bag that was merged from recordings of two releases of a package defines one type twice.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, final

from replayers.importers.message_types import Definition, MessageTypes, Raw, SurveyedBag, TypeFinding


@final
@dataclass(slots=True, kw_only=True)
class Ros1File(SurveyedBag):
    """A bag of ROS 1; opened by `open_ros1`, used inside its stack."""

    reader: Any

    def survey(self) -> None:
        """Reads topics, counts and the start."""
        self.start_ns = int(self.reader.start_time)  # the largest integer where there is no message
        for connection in self.reader.connections:
            topic, found = connection.topic, self.types.learn(_definition(connection))
            if found.kind is not TypeFinding.KNOWN:
                self.skipped.setdefault(topic, found.message)
            elif connection.msgcount:
                self.counts[topic] = self.counts.get(topic, 0) + connection.msgcount

    def raw(self, topics: tuple[str, ...]) -> Iterator[Raw]:
        """Undecoded messages of some topics in the order of their time."""
        wanted = frozenset(topics) - self.skipped.keys()
        chosen = {each.id: _definition(each) for each in self.reader.connections if each.topic in wanted}
        if not chosen:
            return
        connections = [each for each in self.reader.connections if each.id in chosen]
        for connection, stamp_ns, data in self.reader.messages(connections=connections):
            yield int(stamp_ns), connection.topic, chosen[connection.id], bytes(data)


def open_ros1(path: Path, types: MessageTypes, stack: ExitStack) -> Ros1File:
    """The bag, surveyed; open until the stack ends.

    Raises:
        rosbags.rosbag1.ReaderError: it is no bag of ROS 1, or damaged.
    """
    from rosbags.rosbag1 import Reader

    file = Ros1File(reader=stack.enter_context(Reader(path)), types=types)
    file.survey()
    return file


def _definition(connection: Any) -> Definition:
    text = connection.msgdef.data.encode()
    return Definition(kind=connection.msgtype, encoding="ros1", schema_encoding="ros1msg", text=text)
