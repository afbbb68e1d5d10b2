#!/usr/bin/env bash
# mcap 1.6.0: of a file without chunks, "the last message" is the first: reverse=True is dropped.
#
# Expected: iter_messages(reverse=True) gives messages "in descending log time order", whatever the layout of the file; the
#   reader for streams that cannot seek does so. rosbag2's preset fastwrite (noChunking) writes files without chunks.
# What happens: make_reader of a file falls back to reading it from the start, and does not pass reverse on: messages come
#   in ascending order, as if they were descending. Nothing is raised or warned.
# Who is hurt: whoever takes the newest pose, map or outcome as the first of reverse=True: of a log without chunks it is
#   the oldest, while the same code is right on every file with chunks.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mcap==1.6.0
cd "$folder"
cat > show.py <<'PY'
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import Writer

for chunked in (True, False):
    with open("log.mcap", "wb") as stream:
        writer = Writer(stream, use_chunking=chunked)
        writer.start()
        channel = writer.register_channel("/pose", "json", 0)
        for stamp in (10, 20, 30):
            writer.add_message(channel, stamp, b"{}", stamp)
        writer.finish()
    for reader in (make_reader, NonSeekingReader):
        with open("log.mcap", "rb") as stream:
            stamps = [message.log_time for _, _, message in reader(stream).iter_messages(reverse=True)]
        print("chunks" if chunked else "no chunks", reader.__name__, stamps)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "chunks make_reader [30, 20, 10]
chunks NonSeekingReader [30, 20, 10]
no chunks make_reader [10, 20, 30]
no chunks NonSeekingReader [30, 20, 10]" ]
