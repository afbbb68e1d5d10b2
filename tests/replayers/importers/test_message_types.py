"""A type that a bag defines twice, as after an update of its package: each message is read by its own definition."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from replayers.importers.bags import open_bag

KIND = "tag_msgs/msg/Tag"
DEFINITIONS = {"/before": "float64 x\nuint32 id\n", "/after": "uint32 id\nfloat64 x\n"}
"""The two definitions, by the topic of their messages."""
NESTED = "Tag[] tags\n" + "=" * 80 + "\nMSG: tag_msgs/Tag\n"


def store_of(text: str, kind: str = KIND) -> Any:
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, kind))
    return store


def tag(store: Any) -> Any:
    return store.types[KIND](x=1.5, id=7)


def ros1(folder: Path) -> Path:
    path = folder / "both.bag"
    with Writer1(path) as bag:
        for stamp, (topic, text) in enumerate(DEFINITIONS.items(), start=1):
            store = store_of(text)
            connection = bag.add_connection(topic, KIND, typestore=store)
            bag.write(connection, stamp, store.serialize_ros1(tag(store), KIND))
    return path


def mcap(folder: Path) -> Path:
    path = folder / "both.mcap"
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start(profile="ros2")
        for stamp, (topic, text) in enumerate(DEFINITIONS.items(), start=1):
            store = store_of(text)
            schema = writer.register_schema(KIND, "ros2msg", text.encode())
            channel = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channel, stamp, bytes(store.serialize_cdr(tag(store), KIND)), stamp)
        writer.finish()
    return path


def sqlite(folder: Path) -> Path:
    whole = folder / "both"
    whole.mkdir()
    for stamp, (topic, text) in enumerate(DEFINITIONS.items(), start=1):
        store, part = store_of(text), folder / topic[1:]
        with Writer2(part, version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
            connection = bag.add_connection(topic, KIND, typestore=store)
            bag.write(connection, stamp, bytes(store.serialize_cdr(tag(store), KIND)))
        shutil.move(next(part.glob("*.db3")), whole)
    return whole


@pytest.mark.parametrize("write", [ros1, mcap, sqlite])
def test_each_message_is_read_by_the_definition_beside_it(write: Callable[[Path], Path], tmp_path: Path) -> None:
    with open_bag(write(tmp_path)) as bag:
        found = [(each.topic, each.message.x, each.message.id) for each in bag.messages(bag.topics)]
    assert found == [("/before", 1.5, 7), ("/after", 1.5, 7)]
    assert not bag.skipped


def test_a_bag_of_ros1_whose_types_hold_another_in_two_versions_is_read(tmp_path: Path) -> None:
    path, kinds = tmp_path / "nested.bag", ("a_msgs/msg/Tags", "b_msgs/msg/Tags")
    with Writer1(path) as bag:
        for stamp, (kind, (topic, text)) in enumerate(zip(kinds, DEFINITIONS.items(), strict=True), start=1):
            store = store_of(NESTED.replace("Tag[]", "tag_msgs/Tag[]") + text, kind)
            connection = bag.add_connection(topic, kind, typestore=store)
            bag.write(connection, stamp, store.serialize_ros1(store.types[kind](tags=[tag(store)]), kind))
    with open_bag(path) as opened:
        assert [each.message.tags[0].id for each in opened.messages(opened.topics)] == [7, 7]


def test_a_topic_of_ros1_without_a_readable_definition_is_left_out_and_named(tmp_path: Path) -> None:
    path = tmp_path / "odd.bag"
    with Writer1(path) as bag:
        store = store_of(DEFINITIONS["/before"])
        connection = bag.add_connection("/before", KIND, typestore=store)
        bag.write(connection, 1, store.serialize_ros1(tag(store), KIND))
        odd = bag.add_connection("/odd", "odd_msgs/msg/Odd", msgdef="%% no [definition", md5sum="0" * 32)
        bag.write(odd, 2, b"")
    with open_bag(path) as opened:
        assert opened.topics == ("/before", "/odd")
        assert "cannot be parsed" in opened.skipped["/odd"]
        assert [each.topic for each in opened.messages(opened.topics)] == ["/before"]
