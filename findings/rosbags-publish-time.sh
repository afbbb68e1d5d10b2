#!/usr/bin/env bash
# rosbags 0.11.9 with mcap-ros2-support 0.6.0: publish times and sequence numbers of an MCAP are lost on the way.
#
# Expected: a bag that is read and written again keeps both times that MCAP has for a message, receipt and source.
# What happens: the reader gives log_time alone, and the writer puts it in for publish_time too, with sequence 0.
# Who is hurt: whoever filters or converts bags with rosbags and later measures delays or lost messages by them.
# Seen 2026-11-28. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rosbags==0.11.9 mcap==1.6.0 mcap-ros2-support==0.6.0
cd "$folder"
cat > show.py <<'PY'
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.writer import Writer as McapWriter
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Writer
from rosbags.rosbag2.enums import StoragePlugin
from rosbags.typesys import Stores, get_typestore


def show(title, path):
    with path.open("rb") as stream:
        for _, _, message in make_reader(stream).iter_messages():
            print(title, message.log_time, message.publish_time, message.sequence)


before = Path("before.mcap")
with before.open("wb") as stream:
    writer = McapWriter(stream)
    schema = writer.register_msgdef("std_msgs/msg/String", "string data")
    writer.write_message("/words", schema, {"data": "a"}, log_time=50, publish_time=40, sequence=7)
    writer.finish()
types = get_typestore(Stores.ROS2_HUMBLE)
with AnyReader([before], default_typestore=types) as reader:
    with Writer(Path("after"), version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        for connection, stamp, data in reader.messages():
            bag.write(bag.add_connection(connection.topic, connection.msgtype, typestore=types), stamp, data)
show("before", before)
show("after", next(Path("after").glob("*.mcap")))
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "before 50 40 7
after 50 50 0" ]
