#!/usr/bin/env bash
# rosbags 0.11.9 with mcap 1.6.0: of an MCAP without message indexes it counts the messages and gives none.
#
# Expected: MCAP's specification says of a chunk index's message_index_offsets that "an empty map indicates no message
#   indexing is available", so such a chunk is read to see what is in it. rosbag2's MCAP storage has a setting for such
#   files, noMessageIndex.
# What happens: message_count and the topics are right, for they come from the statistics, and messages() ends at once:
#   every chunk is taken for empty. Nothing is raised.
# Who is hurt: whoever converts or evaluates recordings of many small messages, for which the indexes are left out to save
#   room: an empty table, or a converted bag without messages, from a bag that "has" them all.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rosbags==0.11.9 mcap==1.6.0
cd "$folder"
cat > show.py <<'PY'
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import IndexType, Writer
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

types = get_typestore(Stores.ROS2_HUMBLE)
words = types.types["std_msgs/msg/String"]
for name, indexes in (("with", IndexType.ALL), ("without", IndexType.ALL & ~IndexType.MESSAGE)):
    path = Path(f"{name}.mcap")
    with path.open("wb") as stream:
        writer = Writer(stream, index_types=indexes)
        writer.start(profile="ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/words", "cdr", schema)
        for stamp in (10, 20, 30):
            data = bytes(types.serialize_cdr(words(data="a"), "std_msgs/msg/String"))
            writer.add_message(channel, stamp, data, stamp)
        writer.finish()
    with path.open("rb") as stream:
        print(name, "mcap", len(list(make_reader(stream).iter_messages())), end="; ")
    with AnyReader([path]) as reader:
        print("rosbags", "counts", reader.message_count, "and gives", len(list(reader.messages())))
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "with mcap 3; rosbags counts 3 and gives 3
without mcap 3; rosbags counts 3 and gives 0" ]
