#!/usr/bin/env bash
# bosdyn-client 5.2.0: from a robot of software before 4.1, GraphNavClient.download_graph prints to standard output.
#
# Expected: a library that falls back from a call that the robot does not know (DownloadGraphStreaming came with 4.1)
#   to one that it knows does so silently, or by its logger, which it has.
# What happens: print() writes "DownloadGraphStreaming unimplemented. Old robot release?" to standard output at every
#   download; upload_graph does the same. The graph arrives.
# Who is hurt: programs that print JSON or CSV for other programs: with a robot of software 3 or 4.0 their output no
#   longer parses, and nothing fails with the robot that they were developed on.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bosdyn-client==5.2.0 bosdyn-api==5.2.0 bosdyn-core==5.2.0
cd "$folder"
cat > show.py <<'PY'
import contextlib
import io
from concurrent import futures

import grpc
from bosdyn.api import header_pb2
from bosdyn.api.graph_nav import graph_nav_pb2, graph_nav_service_pb2_grpc
from bosdyn.client.graph_nav import GraphNavClient


class OlderRobot(graph_nav_service_pb2_grpc.GraphNavServiceServicer):
    """A robot of software 3 or 4.0: it has DownloadGraph, and DownloadGraphStreaming is unimplemented."""

    def DownloadGraph(self, request, context):
        answer = graph_nav_pb2.DownloadGraphResponse()
        answer.header.error.code = header_pb2.CommonError.CODE_OK
        answer.graph.waypoints.add(id="a")
        return answer


server = grpc.server(futures.ThreadPoolExecutor(max_workers=2))
graph_nav_service_pb2_grpc.add_GraphNavServiceServicer_to_server(OlderRobot(), server)
port = server.add_insecure_port("127.0.0.1:0")
server.start()
client = GraphNavClient()
client.channel = grpc.insecure_channel(f"127.0.0.1:{port}")
printed = io.StringIO()
with contextlib.redirect_stdout(printed):
    graph = client.download_graph()
print("waypoints", len(graph.waypoints))
print("printed", repr(printed.getvalue()))
server.stop(None)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "waypoints 1
printed 'DownloadGraphStreaming unimplemented. Old robot release?\n'" ]
