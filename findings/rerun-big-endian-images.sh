#!/usr/bin/env bash
# rerun-sdk 0.41.0: 16-bit images that are big-endian are shown with their bytes swapped: a depth of 1 m as 59 m.
#
# Expected: sensor_msgs/Image has the field is_bigendian; PointCloud2 has the same one, and Rerun's reader of MCAP honours it.
# What happens: of images it is not read. The bytes of 16UC1, mono16 and 32FC1 are taken over as they are, as little-endian:
#   1000 mm become 59395 mm, metres as floats become about 1e-41. rosbags gives the flag, and the numbers are right by it.
# Who is hurt: whoever looks at depth or thermal images in Rerun that were made from PGM or PNG (16 bits are big-endian there)
#   or by a camera that sends the upper byte first.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rerun-sdk==0.41.0 rosbags==0.11.9 numpy==2.4.6
cd "$folder"
export HOME=$folder  # rerun writes its settings there
cat > show.py <<'PY'
import subprocess
import sys
from pathlib import Path

import numpy as np
from rerun.chunk import RrdReader
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

ros = get_typestore(Stores.ROS2_HUMBLE)
TIME, HEADER = ros.types["builtin_interfaces/msg/Time"], ros.types["std_msgs/msg/Header"]
IMAGE, CLOUD = ros.types["sensor_msgs/msg/Image"], ros.types["sensor_msgs/msg/PointCloud2"]
FIELD = ros.types["sensor_msgs/msg/PointField"]
KINDS = {"16UC1": "u2", "mono16": "u2", "32FC1": "f4"}


def as_bytes(values, order, kind):
    return np.frombuffer(np.array(values, dtype=order + kind).tobytes(), dtype=np.uint8)


with Writer(Path("bag"), version=9, storage_plugin=StoragePlugin.MCAP) as bag:

    def put(topic, message):
        connection = bag.add_connection(topic, message.__msgtype__, typestore=ros)
        bag.write(connection, 1, ros.serialize_cdr(message, message.__msgtype__))

    for order, big in (("<", 0), (">", 1)):
        header = HEADER(TIME(1, 0), "camera")
        for encoding, kind in KINDS.items():
            unit = 1.0 if kind == "f4" else 1000
            data = as_bytes([unit, 2 * unit], order, kind)
            put(f"/{encoding}_{big}", IMAGE(header, 1, 2, encoding, big, data.size, data))
        fields = [FIELD(name, 4 * number, FIELD.FLOAT32, 1) for number, name in enumerate("xyz")]
        points = as_bytes([1.0, 2.0, 3.0], order, "f4")
        put(f"/points_{big}", CLOUD(header, 1, 1, fields, bool(big), 12, 12, points, True))

with AnyReader([Path("bag")]) as reader:
    for connection, _, data in reader.messages():
        if connection.topic == "/16UC1_1":
            image = reader.deserialize(data, connection.msgtype)
            print("rosbags: is_bigendian", image.is_bigendian, image.data.view(">u2").tolist())
command = [Path(sys.executable).with_name("rerun"), "mcap", "convert", "bag/bag.mcap", "-o", "bag.rrd"]
subprocess.run(command, check=True, capture_output=True)
found = {}
for chunk in RrdReader("bag.rrd").stream():
    batch, topic = chunk.to_record_batch(), chunk.entity_path.strip("/")
    for name in {"DepthImage:buffer", "Points3D:positions"} & set(batch.schema.names):
        values = batch.column(name).to_pylist()
        if name == "DepthImage:buffer":
            buffer = np.array(values[0][0], dtype=np.uint8)
            numbers = buffer.view("<" + KINDS[topic[:-2]]).tolist()
            found[topic] = [float(f"{value:.4g}") if value < 1 else value for value in numbers]
        elif name == "Points3D:positions":
            found[topic] = values[0]
for topic, values in sorted(found.items()):
    print("Rerun:", topic[:-2], "big-endian" if topic.endswith("1") else "little-endian", values)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "rosbags: is_bigendian 1 [1000, 2000]
Rerun: 16UC1 little-endian [1000, 2000]
Rerun: 16UC1 big-endian [59395, 53255]
Rerun: 32FC1 little-endian [1.0, 2.0]
Rerun: 32FC1 big-endian [4.601e-41, 8.968e-44]
Rerun: mono16 little-endian [1000, 2000]
Rerun: mono16 big-endian [59395, 53255]
Rerun: points little-endian [[1.0, 2.0, 3.0]]
Rerun: points big-endian [[1.0, 2.0, 3.0]]" ]
