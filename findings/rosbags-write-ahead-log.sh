#!/usr/bin/env bash
# rosbags 0.11.9: messages of an SQLite bag that are still in its write-ahead log are left out, without a word.
#
# Expected: a .db3 whose recorder was killed is read as SQLite reads it: the database and the -wal beside it. rosbag2
#   records so (journal_mode WAL, synchronous NORMAL) with its preset "resilient", which is for that case.
# What happens: rosbags opens the database as immutable, so that the log is not looked at: it gives only the messages of
#   the last checkpoint, and says that these are all. Python's own sqlite3 gives the rest too.
# Who is hurt: whoever reads the bags of a crash or of a robot that was switched off: the last seconds, which are what one
#   looks for, are missing, and the count agrees with what is there.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rosbags==0.11.9
cd "$folder"
cat > record.py <<'PY'
"""Records two messages, of which one is checkpointed, and ends as a process does that is killed."""

import os
import sqlite3
from pathlib import Path

from rosbags.typesys import Stores, get_typestore

types = get_typestore(Stores.ROS2_HUMBLE)
words = types.types["std_msgs/msg/String"]
Path("bag").mkdir()
database = sqlite3.connect("bag/bag_0.db3", isolation_level=None)
database.execute("PRAGMA journal_mode = WAL")
database.execute("PRAGMA synchronous = NORMAL")
database.executescript(
    "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
    "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);"
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
    " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,"
    " data BLOB NOT NULL);"
    "CREATE INDEX timestamp_idx ON messages (timestamp ASC);"
    "INSERT INTO schema VALUES (3, 'humble');"
    "INSERT INTO topics VALUES (1, '/words', 'std_msgs/msg/String', 'cdr', '');"
)
for stamp, text in ((10, "before"), (20, "after")):
    data = bytes(types.serialize_cdr(words(data=text), "std_msgs/msg/String"))
    database.execute("INSERT INTO messages VALUES (NULL, 1, ?, ?)", (stamp, data))
    if text == "before":
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
os._exit(0)
PY
cat > show.py <<'PY'
import shutil
import sqlite3
from pathlib import Path

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

print(sorted(path.name for path in Path("bag").iterdir() if path.suffix != ".db3-shm"))
with AnyReader([Path("bag/bag_0.db3")], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
    found = [reader.deserialize(data, connection.msgtype).data for connection, _, data in reader.messages()]
    print("rosbags", reader.message_count, found, reader.end_time)
shutil.copytree("bag", "copy")
with sqlite3.connect("copy/bag_0.db3") as database:
    print("sqlite3", *database.execute("SELECT count(*), max(timestamp) FROM messages").fetchone())
PY
"$folder/venv/bin/python" -W ignore record.py
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "['bag_0.db3', 'bag_0.db3-wal']
rosbags 1 ['before'] 11
sqlite3 2 20" ]
