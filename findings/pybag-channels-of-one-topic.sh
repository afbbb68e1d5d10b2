#!/usr/bin/env bash
# pybag-sdk 0.13.0: of a topic with two publishers, an MCAP's messages of the second are left out, and not counted.
#
# Expected: a topic may have several channels; MCAP's library says of them: "a Channel represents a single connection from a
#   publisher to a topic, so each topic will have one Channel per publisher". ROS 1 bags with several publishers of a topic
#   (/tf, /diagnostics, /rosout) become such files, and so do merged ones. pybag's own info, filter and merge keep all
#   channels, and its reader of ROS 1 bags gives the messages of all connections.
# What happens: its reader of MCAP looks for one channel a topic and takes the first: of 8 messages 4 are given, and
#   get_message_count says 4. pybag convert writes half of them to the ROS 1 bag, and ends with 0. mcap 1.6.0 and rosbags
#   0.11.9 give all 8.
# Who is hurt: whoever reads transforms or logs of several nodes: all frames of the second publisher are missing, without a word.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pybag-sdk==0.13.0 mcap==1.6.0 rosbags==0.11.9
cd "$folder"
cat > show.py <<'PY'
import logging
import subprocess
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import Writer
from pybag import Reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

logging.disable(logging.WARNING)
log, bag = Path("two.mcap"), Path("two.bag")
with log.open("wb") as stream:
    writer = Writer(stream)
    writer.start("ros2")
    schema = writer.register_schema("std_msgs/msg/Float64", "ros2msg", b"float64 data\n")
    publishers = [writer.register_channel("/level", "cdr", schema, {"callerid": name}) for name in ("/left", "/right")]
    zero = bytes((0, 1, 0, 0)) + bytes(8)  # little-endian CDR, 0.0
    for number in range(8):
        writer.add_message(publishers[number % 2], number * 10**9, zero, number * 10**9, number)
    writer.finish()

types = get_typestore(Stores.ROS2_HUMBLE)
with log.open("rb") as stream:
    print("mcap", [message.log_time // 10**9 for _, _, message in make_reader(stream).iter_messages()])
with AnyReader([log], default_typestore=types) as reader:
    print("rosbags", [stamp // 10**9 for _, stamp, _ in reader.messages()])
with Reader.from_file(str(log)) as reader:
    stamps = [message.log_time // 10**9 for message in reader.messages("/level")]
    print("pybag", stamps, "count", reader.get_message_count("/level"))
command = Path(sys.executable).with_name("pybag")
done = subprocess.run([command, "convert", log, "-o", bag], capture_output=True, check=False)
with AnyReader([bag]) as reader:
    print("pybag convert exits", done.returncode, "messages in the bag", reader.message_count)
done = subprocess.run([command, "filter", log, "-o", "copy.mcap"], capture_output=True, check=False)
with open("copy.mcap", "rb") as stream:
    print("pybag filter exits", done.returncode, "messages in the copy", len(list(make_reader(stream).iter_messages())))
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "mcap [0, 1, 2, 3, 4, 5, 6, 7]
rosbags [0, 1, 2, 3, 4, 5, 6, 7]
pybag [0, 2, 4, 6] count 4
pybag convert exits 0 messages in the bag 4
pybag filter exits 0 messages in the copy 8" ]
