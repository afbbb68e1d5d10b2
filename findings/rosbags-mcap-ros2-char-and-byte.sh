#!/usr/bin/env bash
# rosbags 0.11.9 with mcap-ros2-support 0.6.0: they read char and byte of one recording with opposite signs.
#
# Expected: ROS 2 maps char to uint8 and byte to octet, so that both are from 0 to 255 (its interface definition, "field
#   types"), in every reader of a recording.
# What happens: of the byte 0xC8, rosbags reads char as 200 and byte as -56, mcap-ros2-support char as -56 and byte as 200;
#   arrays of them too.
# Who is hurt: whoever compares two readers, or turns a bag with status bytes (diagnostic levels, error codes) into an MCAP
#   log with one and reads it with the other.
# Seen 2026-11-28. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rosbags==0.11.9 mcap-ros2-support==0.6.0
cd "$folder"
cat > show.py <<'PY'
from pathlib import Path

from mcap.writer import Writer
from mcap_ros2.reader import read_ros2_messages
from rosbags.highlevel import AnyReader

TEXT = b"char c\nbyte b\nchar[2] cs\nbyte[2] bs\nuint8 u\nint8 i"
with open("bag.mcap", "wb") as stream:
    writer = Writer(stream)
    writer.start(profile="ros2")
    channel = writer.register_channel("/status", "cdr", writer.register_schema("x_msgs/msg/Status", "ros2msg", TEXT))
    writer.add_message(channel, log_time=1, publish_time=1, data=bytes([0, 1, 0, 0, *[200] * 8]))
    writer.finish()
NAMES = ("c", "b", "cs", "bs", "u", "i")
for read in read_ros2_messages("bag.mcap"):
    print("mcap-ros2-support", *(list(v) if n.endswith("s") else v for n in NAMES for v in [getattr(read.ros_msg, n)]))
with AnyReader([Path("bag.mcap")]) as reader:
    for connection, _, data in reader.messages():
        read = reader.deserialize(data, connection.msgtype)
        print("rosbags", *(v.tolist() if n.endswith("s") else v for n in NAMES for v in [getattr(read, n)]))
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "mcap-ros2-support -56 200 [-56, -56] [200, 200] 200 -56
rosbags 200 -56 [200, 200] [-56, -56] 200 -56" ]
