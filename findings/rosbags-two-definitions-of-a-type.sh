#!/usr/bin/env bash
# rosbags 0.11.9 with mcap 1.6.0 and mcap-ros2-support 0.6.0: of two definitions of one type the last is used for all
# messages: a mug at (3, 2) is read as one at (2, 3), without a word.
#
# Expected: ROS 1 bags and MCAP store with every topic the definition of its type, so that old recordings stay readable
#   when a message changes; AnyReader takes several bags at once and gives each message as it was written.
# What happens: it puts the definitions of all topics of all bags into one table, by name. The last one read wins, and it
#   checks no other: neither of a merged bag nor of two bags. Where the bytes fit, the fields come out in other places.
# Who is hurt: whoever reads recordings from before and after an update of a message package together, or of two robots
#   of which one was updated. One bag at a time is right, and so is a reader that keeps to the schema of the channel.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rosbags==0.11.9 mcap==1.6.0 mcap-ros2-support==0.6.0
cd "$folder"
cat > show.py <<'PY'
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

KIND = "my_msgs/msg/Seen"
DEFINITIONS = {"/first": "string name\nfloat64 x\nfloat64 y\n", "/second": "string name\nfloat64 y\nfloat64 x\n"}


def written(text):
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, KIND))
    return store, store.types[KIND](name="mug", x=3.0, y=2.0)


def write_ros1(name, *topics):
    with Writer(Path(name)) as bag:
        for stamp, topic in enumerate(topics):
            store, message = written(DEFINITIONS[topic])
            connection = bag.add_connection(topic, KIND, typestore=store)
            bag.write(connection, stamp, store.serialize_ros1(message, KIND))


def show(title, *names):
    with AnyReader([Path(name) for name in names]) as reader:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            print(title, connection.topic, message.name, (message.x, message.y))


write_ros1("first.bag", "/first")
write_ros1("second.bag", "/second")
write_ros1("merged.bag", "/first", "/second")
show("ROS 1, alone", "first.bag")
show("ROS 1, two bags", "first.bag", "second.bag")
show("ROS 1, the other way round", "second.bag", "first.bag")
show("ROS 1, merged", "merged.bag")
with open("both.mcap", "wb") as stream:
    writer = McapWriter(stream)
    writer.start(profile="ros2")
    for stamp, (topic, text) in enumerate(DEFINITIONS.items()):
        store, message = written(text)
        channel = writer.register_channel(topic, "cdr", writer.register_schema(KIND, "ros2msg", text.encode()))
        writer.add_message(channel, stamp, bytes(store.serialize_cdr(message, KIND)), stamp)
    writer.finish()
show("MCAP", "both.mcap")
with open("both.mcap", "rb") as stream:
    for _, channel, _, message in make_reader(stream, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
        print("MCAP by its schemas", channel.topic, message.name, (message.x, message.y))
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "ROS 1, alone /first mug (3.0, 2.0)
ROS 1, two bags /first mug (2.0, 3.0)
ROS 1, two bags /second mug (3.0, 2.0)
ROS 1, the other way round /second mug (2.0, 3.0)
ROS 1, the other way round /first mug (3.0, 2.0)
ROS 1, merged /first mug (2.0, 3.0)
ROS 1, merged /second mug (3.0, 2.0)
MCAP /first mug (2.0, 3.0)
MCAP /second mug (3.0, 2.0)
MCAP by its schemas /first mug (3.0, 2.0)
MCAP by its schemas /second mug (3.0, 2.0)" ]
