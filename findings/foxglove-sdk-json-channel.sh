#!/usr/bin/env bash
# foxglove-sdk 0.30.3 with mcap 1.6.0: a JSON channel without a schema has one in the file: jsonschema, of zero bytes.
#
# Expected: MCAP has a way to say "no schema" (schema id 0), and what says jsonschema is a JSON Schema.
# What happens: Channel("/facts").log({...}) writes a schema record with encoding jsonschema, empty data and a generated
#   name; a reader that parses schemas by their encoding meets text that is not JSON.
# Who is hurt: readers and doctors of MCAP that check JSON channels against their schema.
# Seen 2026-11-28. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check foxglove-sdk==0.30.3 mcap==1.6.0
cd "$folder"
cat > show.py <<'PY'
import json

import foxglove
from mcap.reader import make_reader

writer = foxglove.open_mcap("facts.mcap")
foxglove.Channel("/facts").log({"a": 1}, log_time=5)
writer.close()
with open("facts.mcap", "rb") as stream:
    summary = make_reader(stream).get_summary()
for channel in summary.channels.values():
    schema = summary.schemas[channel.schema_id]
    print(channel.topic, channel.message_encoding, schema.encoding, schema.name.split("-")[0], len(schema.data))
    try:
        json.loads(schema.data)
    except ValueError:
        print("no JSON")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "/facts json jsonschema schema 0
no JSON" ]
