#!/usr/bin/env bash
# rosbags 0.11.9: of a bag of several files, those whose QoS of a topic differs from metadata.yaml's are left out.
#
# Expected: metadata.yaml lists a topic once for all files of a bag; ros2 bag reindex takes the QoS of the last file for it
#   (reindexer.cpp, aggregate_metadata). QoS says how messages were sent; it does not tell whose messages they are.
# What happens: rosbags looks for each file's topics in metadata.yaml by name, type and QoS. Where a node was restarted with
#   another reliability, its earlier file is skipped: message_count says 4, messages() gives 2. Nothing is raised.
# Who is hurt: whoever evaluates or converts a recording that was stopped and resumed: whole files are missing, and the count
#   that one would check against is the full one.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rosbags==0.11.9
cd "$folder"
cat > show.py <<'PY'
import sqlite3
from contextlib import closing
from pathlib import Path

from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

TABLES = """
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
 serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
 data BLOB NOT NULL);
INSERT INTO schema VALUES (3, 'humble');
"""
types = get_typestore(Stores.ROS2_HUMBLE)
words = types.types["std_msgs/msg/String"]


def qos(reliability):
    forever = "\n    sec: 9223372036\n    nsec: 854775807"
    return (
        f"- history: 1\n  depth: 10\n  reliability: {reliability}\n  durability: 2\n  deadline:{forever}\n"
        f"  lifespan:{forever}\n  liveliness: 1\n  liveliness_lease_duration:{forever}\n"
        "  avoid_ros_namespace_conventions: false"
    )


def bag(name, reliabilities):
    """Two files of two messages each; metadata.yaml has the QoS of the last."""
    Path(name).mkdir()
    for number, reliability in enumerate(reliabilities):
        with closing(sqlite3.connect(f"{name}/{name}_{number}.db3")) as database, database:
            database.executescript(TABLES)
            topic = ("/words", "std_msgs/msg/String", "cdr", qos(reliability))
            database.execute("INSERT INTO topics VALUES (1, ?, ?, ?, ?)", topic)
            for stamp in (20 * number + 10, 20 * number + 20):
                data = bytes(types.serialize_cdr(words(data="a"), "std_msgs/msg/String"))
                database.execute("INSERT INTO messages VALUES (NULL, 1, ?, ?)", (stamp, data))
    Path(f"{name}/metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  duration:\n    nanoseconds: 30\n"
        "  starting_time:\n    nanoseconds_since_epoch: 10\n  message_count: 4\n  topics_with_message_count:\n"
        "    - topic_metadata:\n        name: /words\n        type: std_msgs/msg/String\n"
        "        serialization_format: cdr\n"
        f"        offered_qos_profiles: \"{qos(reliabilities[-1]).replace(chr(10), chr(92) + 'n')}\"\n"
        "      message_count: 4\n  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n"
        f"    - {name}_0.db3\n    - {name}_1.db3\n"
    )
    with Reader(name) as reader:
        print(name, "counts", reader.message_count, "gives", [stamp for _, stamp, _ in reader.messages()])


bag("same", (1, 1))
bag("restarted", (2, 1))
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "same counts 4 gives [10, 20, 30, 40]
restarted counts 4 gives [30, 40]" ]
