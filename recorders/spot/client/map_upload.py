"""Upload of a recorded GraphNav map to the robot, from a folder written by the tablet or the SDK.

A robot forgets its map when it restarts. The folder holds `graph`, `waypoint_snapshots/` and `edge_snapshots/`
(Spot SDK, GraphNavClient.write_graph_and_snapshots; an Autowalk's .walk folder holds them as well).
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias, TypeVar

from bosdyn.api.graph_nav import graph_nav_pb2, map_pb2
from bosdyn.client.exceptions import ResponseError, RpcError, UnimplementedError
from google.protobuf.message import DecodeError

from recorders.spot.client.connection import Connection, reason_of
from recorders.spot.client.errors import MapRefused, MapUploadBrokeOff
from recorders.spot.client.graph_nav_map import require_sound
from workbench.errors import FileMissing, MalformedFile

UPLOAD_TIMEOUT_S, MIN_BYTES_PER_S = 30.0, 100e3
"""An upload may take UPLOAD_TIMEOUT_S, and as long as its bytes take on a slow wireless network."""
UPLOAD_ATTEMPTS, UPLOAD_PAUSE_S = 4, 3.0
"""How often a snapshot is sent before the upload fails, and the pause in seconds before each time but the first."""
Snapshot: TypeAlias = map_pb2.WaypointSnapshot | map_pb2.EdgeSnapshot
MapPart = TypeVar("MapPart", map_pb2.Graph, map_pb2.WaypointSnapshot, map_pb2.EdgeSnapshot)
MAP_FOLDER = "Give the folder of a recorded GraphNav map"


def read_graph(folder: Path) -> map_pb2.Graph:
    """The graph of a map's folder.

    Raises:
        FileMissing, MalformedFile: it is missing or invalid.
    """
    graph = map_pb2.Graph()
    _read(graph, folder / "graph")
    if not graph.waypoints:
        raise MalformedFile(folder / "graph", "it holds no waypoint", MAP_FOLDER)
    require_sound(graph, folder / "graph")
    return graph


def upload_map(connection: Connection, folder: Path) -> int:
    """Replace the robot's map; returns the number of waypoints. Requires the lease.

    The whole folder is read before the robot's own map is cleared.

    Raises:
        FileMissing, MalformedFile: the folder contains no valid map. MapRefused: the robot refuses it, or asks for
            a snapshot that is not of this map. MapUploadBrokeOff: the network failed again and again.
    """
    graph, snapshots, edges = read_map_folder(folder)
    client, wallet = connection.client("graph-nav-service"), connection.client("lease").lease_wallet
    try:
        client.clear_graph(wallet.advance().lease_proto, timeout=connection.timeout_s)
        answer: graph_nav_pb2.UploadGraphResponse = client.upload_graph(
            wallet.advance().lease_proto,  # these two calls do not use the wallet
            graph,
            generate_new_anchoring=not graph.anchoring.anchors,
            timeout=_time_for(graph),
        )
        for name in answer.unknown_waypoint_snapshot_ids:
            _send(connection, client.upload_waypoint_snapshot, snapshots[name])
        for name in answer.unknown_edge_snapshot_ids:
            _send(connection, client.upload_edge_snapshot, edges[name])
    except ResponseError as error:
        raise MapRefused(str(connection.address), reason_of(error)) from error
    except KeyError as error:
        raise MapRefused(str(connection.address), f"it asks for a snapshot {error} that is not of this map") from None
    return len(graph.waypoints)


def _send(connection: Connection, upload: Callable[..., object], part: Snapshot) -> None:
    """Upload a snapshot; again if the network fails, which replaces what came of it before.

    Raises:
        MapUploadBrokeOff: the network failed UPLOAD_ATTEMPTS times.
    """
    for left in reversed(range(UPLOAD_ATTEMPTS)):
        try:
            upload(part, timeout=_time_for(part))
            return
        except UnimplementedError:
            raise
        except RpcError as error:
            if not left:
                raise MapUploadBrokeOff(str(connection.address), reason_of(error)) from error
        connection.clock.sleep(UPLOAD_PAUSE_S)


def _time_for(part: map_pb2.Graph | map_pb2.WaypointSnapshot | map_pb2.EdgeSnapshot) -> float:
    """The time limit of an upload in seconds."""
    return UPLOAD_TIMEOUT_S + part.ByteSize() / MIN_BYTES_PER_S


def read_map_folder(
    folder: Path,
) -> tuple[map_pb2.Graph, dict[str, map_pb2.WaypointSnapshot], dict[str, map_pb2.EdgeSnapshot]]:
    """The graph of a map's folder with all snapshots that it names, by id: of waypoints, and of edges.

    Raises:
        FileMissing, MalformedFile: a part is missing or invalid.
    """
    graph = read_graph(folder)
    return graph, *_read_snapshots(graph, folder)


def _read_snapshots(
    graph: map_pb2.Graph, folder: Path
) -> tuple[dict[str, map_pb2.WaypointSnapshot], dict[str, map_pb2.EdgeSnapshot]]:
    """Every snapshot that the graph names, by id: of waypoints, and of edges."""
    waypoint_ids = sorted({waypoint.snapshot_id for waypoint in graph.waypoints if waypoint.snapshot_id})
    edge_ids = sorted({edge.snapshot_id for edge in graph.edges if edge.snapshot_id})
    for name in (*waypoint_ids, *edge_ids):
        if name in (".", "..") or any(mark in name for mark in ("/", "\\", "\0")):
            raise MalformedFile(folder / "graph", f"the snapshot id {name!r} is not a file name", MAP_FOLDER)
    snapshots = {i: _read(map_pb2.WaypointSnapshot(), folder / "waypoint_snapshots" / i) for i in waypoint_ids}
    return snapshots, {i: _read(map_pb2.EdgeSnapshot(), folder / "edge_snapshots" / i) for i in edge_ids}


def _read(message: MapPart, path: Path) -> MapPart:
    if not path.is_file():
        raise FileMissing(path)
    data = path.read_bytes()
    try:
        message.ParseFromString(data)
    except DecodeError as error:
        raise MalformedFile(path, "not a GraphNav map", MAP_FOLDER) from error
    if not data:
        raise MalformedFile(path, "an empty file", MAP_FOLDER)
    return message
