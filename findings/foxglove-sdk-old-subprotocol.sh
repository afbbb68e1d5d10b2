#!/usr/bin/env bash
# foxglove-sdk 0.30.3 (PyPI) with @foxglove/ws-protocol 0.8.0 (npm): Foxglove's client cannot talk to Foxglove's server.
#
# Expected: both implement the Foxglove WebSocket protocol, the client as the package's readme says "for the Foxglove
#   WebSocket protocol"; start_server() and FoxgloveClient meet.
# What happens: the client asks for the subprotocol foxglove.websocket.v1, the server knows foxglove.sdk.v1 alone and
#   answers HTTP 400; its log line says only "handshake failed". With the new name the same client gets the channels:
#   what is said afterwards is the same.
# Who is hurt: scripts and viewers built on the npm client (Lichtblick before its pull request 819 too) that meet a
#   robot whose bridge was updated.
# Seen 2026-11-28. Exits 1 if the output changes. Needs node and npm.
set -euo pipefail
folder=$(mktemp -d)
trap 'kill "$server" 2>/dev/null || true; rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check foxglove-sdk==0.30.3
cd "$folder"
npm install --silent --no-audit --no-fund @foxglove/ws-protocol@0.8.0 ws@8.18.0
cat > server.py <<'PY'
import time

import foxglove

server = foxglove.start_server(port=0)
foxglove.Channel("/facts").log({"a": 1})
print(server.port, flush=True)
time.sleep(60)
PY
cat > client.js <<'JS'
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");
const [, , port, name] = process.argv;
const asked = name || FoxgloveClient.SUPPORTED_SUBPROTOCOL;
const client = new FoxgloveClient({ ws: new WebSocket("ws://127.0.0.1:" + port, [asked]) });
client.on("error", (error) => { console.log(asked + ": " + error.message); process.exit(0); });
client.on("advertise", (channels) => { console.log(asked + ": " + channels[0].topic); process.exit(0); });
JS
"$folder/venv/bin/python" -W ignore server.py > port 2> log &
server=$!
until [ -s port ]; do sleep 0.1; done
seen=$(node client.js "$(cat port)"; node client.js "$(cat port)" foxglove.sdk.v1)
echo "$seen"
[ "$seen" = "foxglove.websocket.v1: Unexpected server response: 400
foxglove.sdk.v1: /facts" ]
