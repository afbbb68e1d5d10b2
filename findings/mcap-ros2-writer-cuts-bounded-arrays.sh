#!/usr/bin/env bash
# mcap-ros2-support 0.6.0: its writer cuts what is too long for a bounded array and pads what is too short for a fixed one.
#
# Expected: a message that does not fit its type is refused, as the message classes of rclpy refuse it.
# What happens: of int32[<=2] with three values two are written; float64[3] with one value is filled up with zeros, in the
#   caller's message too (as None); a string beyond its bound is written whole, against the same bound. No word of any.
# Who is hurt: whoever writes a recording of a joint command or a covariance of the wrong length: the file opens everywhere
#   and holds numbers that nobody sent.
# Seen 2026-11-28. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mcap-ros2-support==0.6.0
cd "$folder"
cat > show.py <<'PY'
from mcap_ros2.reader import read_ros2_messages
from mcap_ros2.writer import Writer

message = {"joints": [1, 2, 3], "position": [0.5], "name": "too long"}
with open("log.mcap", "wb") as stream:
    writer = Writer(stream)
    schema = writer.register_msgdef("x_msgs/msg/Command", "int32[<=2] joints\nfloat64[3] position\nstring<=3 name")
    writer.write_message("/command", schema, message, log_time=1, publish_time=1)
    writer.finish()
for read in read_ros2_messages("log.mcap"):
    print("read", read.ros_msg.joints, read.ros_msg.position, repr(read.ros_msg.name))
print("the caller's", message["position"])
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "read [1, 2] [0.5, 0.0, 0.0] 'too long'
the caller's [0.5, None, None]" ]
