#!/usr/bin/env bash
# mcap-protobuf-support 0.6.0 with mcap-ros2-support 0.6.0: a message with a log time alone was "published" at the time
# of the conversion.
#
# Expected: MCAP's specification says of publish_time: "If not available, must be set to the log time"; the ROS 2 writer
#   of the same project does so, and says so in its docstring.
# What happens: the protobuf writer fills in the computer's clock, independently of the log time that it was given.
# Who is hurt: whoever converts old recordings or writes simulated time: viewers that order by publish time, and delays
#   between the two stamps, show years; the file differs with every run.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mcap==1.6.0 mcap-ros2-support==0.6.0 mcap-protobuf-support==0.6.0 foxglove-schemas-protobuf==0.4.0 protobuf==7.36.2
cd "$folder"
cat > show.py <<'PY'
import time

from foxglove_schemas_protobuf.Point3_pb2 import Point3
from mcap.reader import make_reader
from mcap_protobuf.writer import Writer as ProtobufWriter
from mcap_ros2.writer import Writer as Ros2Writer

RECORDED = 1_500_000_000_000_000_000
with open("ros2.mcap", "wb") as stream:
    writer = Ros2Writer(stream)
    writer.write_message("/point", writer.register_msgdef("a/msg/P", "float64 x"), {"x": 1.0}, log_time=RECORDED)
    writer.finish()
started = time.time_ns()
with open("protobuf.mcap", "wb") as stream, ProtobufWriter(stream) as writer:
    writer.write_message("/point", Point3(x=1), log_time=RECORDED)
for name in ("ros2", "protobuf"):
    with open(f"{name}.mcap", "rb") as stream:
        for _, _, message in make_reader(stream).iter_messages():
            times = {RECORDED: "as recorded"}
            print(name, *(times.get(t, "now" if t >= started else t) for t in (message.log_time, message.publish_time)), sep="; ")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "ros2; as recorded; as recorded
protobuf; as recorded; now" ]
