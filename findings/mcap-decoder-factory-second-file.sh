#!/usr/bin/env bash
# mcap 1.6.0 with mcap-ros2-support 0.6.0 and mcap-protobuf-support 0.6.0: a DecoderFactory that has read one file
# decodes the next with the types of the first.
#
# Expected: a factory is asked for a decoder with the whole schema, its name and its text; one factory serves many files.
# What happens: it remembers decoders by the schema's id alone, and ids are given anew in every file. Where the bytes fit
#   another type, wrong numbers come out under wrong names, and the schema handed back beside them is the right one.
# Who is hurt: whoever makes the factory once and reads a folder of logs: a wrench is read as a twist, a position as a size.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mcap==1.6.0 mcap-ros2-support==0.6.0 mcap-protobuf-support==0.6.0 foxglove-schemas-protobuf==0.4.0 protobuf==7.36.2
cd "$folder"
cat > show.py <<'PY'
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory as ProtobufFactory
from mcap_protobuf.writer import Writer as ProtobufWriter
from mcap_ros2.decoder import DecoderFactory as Ros2Factory
from mcap_ros2.writer import Writer as Ros2Writer

VECTOR = "\n" + "=" * 80 + "\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
six = [{"x": 1.0, "y": 2.0, "z": 3.0}, {"x": 4.0, "y": 5.0, "z": 6.0}]
for kind, names in (("Twist", ("linear", "angular")), ("Wrench", ("force", "torque"))):
    with open(f"{kind}.mcap", "wb") as stream:
        writer = Ros2Writer(stream)
        text = "".join(f"geometry_msgs/Vector3 {name}\n" for name in names) + VECTOR
        schema = writer.register_msgdef(f"geometry_msgs/msg/{kind}", text)
        writer.write_message("/topic", schema, dict(zip(names, six, strict=True)), log_time=1)
        writer.finish()
for message in (Point3(x=1, y=2, z=3), Quaternion(x=0, y=0, z=0, w=1)):
    with open(f"{type(message).__name__}.mcap", "wb") as stream, ProtobufWriter(stream) as writer:
        writer.write_message("/topic", message, log_time=1, publish_time=1)
for factory, files in ((Ros2Factory(), ("Twist", "Wrench")), (ProtobufFactory(), ("Point3", "Quaternion"))):
    for file in files:
        with open(f"{file}.mcap", "rb") as stream:
            for schema, _, _, message in make_reader(stream, decoder_factories=[factory]).iter_decoded_messages():
                print(schema.name, "read as", type(message).__name__)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "geometry_msgs/msg/Twist read as Twist
geometry_msgs/msg/Wrench read as Twist
foxglove.Point3 read as Point3
foxglove.Quaternion read as Point3" ]
