#!/usr/bin/env bash
# pybag-sdk 0.13.0: a joint state without velocities cannot be read, not even one that pybag wrote.
#
# Expected: of an empty sequence CDR holds the length alone: the padding before the first element is part of the elements
#   ("in the case when the sequence is empty ... that alignment must not happen", eProsima/Fast-CDR pull request 6; ROS 2's
#   own messages are so). A reader that knows the type goes on behind the length.
# What happens: pybag's reader skips to the next multiple of 8 behind the length of an empty float64[], and reads what follows
#   4 bytes late: sensor_msgs/JointState with empty velocity and effort, as many drivers send it, ends with struct.error, and so
#   does an empty std_msgs/Float64MultiArray. Its writer is right: mcap 1.6.0 with mcap-ros2-support 0.6.0 and rosbags 0.11.9
#   read the same file. Filled sequences are read, and empty ones where the length happens to end on a multiple of 8.
# Who is hurt: whoever reads joint states or trajectories with pybag: the first such message ends the iteration of the topic.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pybag-sdk==0.13.0 mcap==1.6.0 mcap-ros2-support==0.6.0 rosbags==0.11.9
cd "$folder"
cat > show.py <<'PY'
import logging
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from pybag import Reader
from pybag.mcap_writer import McapFileWriter
from pybag.ros2.humble import builtin_interfaces, sensor_msgs, std_msgs
from rosbags.highlevel import AnyReader

logging.disable(logging.WARNING)
header = std_msgs.Header(stamp=builtin_interfaces.Time(sec=1, nanosec=2), frame_id="base")


def by_mcap(path):
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return [each.decoded_message for each in reader.iter_decoded_messages()]


def by_rosbags(path):
    with AnyReader([path]) as reader:
        return [reader.deserialize(data, connection.msgtype) for connection, _, data in reader.messages()]


def by_pybag(path):
    with Reader.from_file(str(path)) as reader:
        return [message.data for message in reader.messages("/joints")]


for name, velocity, effort in (("all", [0.1], [2.0]), ("positions alone", [], [])):
    path = Path(f"{len(velocity)}.mcap")
    with McapFileWriter.open(str(path), profile="ros2") as writer:
        state = sensor_msgs.JointState(header=header, name=["hip"], position=[0.5], velocity=velocity, effort=effort)
        writer.write_message("/joints", 1, state)
    for read in (by_mcap, by_rosbags, by_pybag):
        try:
            (found,) = read(path)
            shown = [[float(value) for value in values] for values in (found.position, found.velocity, found.effort)]
        except Exception as error:
            shown = f"{type(error).__module__}.{type(error).__name__}"
        print(name, read.__name__, shown)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "all by_mcap [[0.5], [0.1], [2.0]]
all by_rosbags [[0.5], [0.1], [2.0]]
all by_pybag [[0.5], [0.1], [2.0]]
positions alone by_mcap [[0.5], [], []]
positions alone by_rosbags [[0.5], [], []]
positions alone by_pybag struct.error" ]
