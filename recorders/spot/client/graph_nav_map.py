"""Parts of a recorded GraphNav map as files: graph, waypoints, snapshots, and poses as matrices."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from bosdyn.api.graph_nav import map_pb2
from bosdyn.client.math_helpers import SE3Pose
from google.protobuf.message import DecodeError

from workbench.arrays import Floats

Graph = map_pb2.Graph
Waypoint = map_pb2.Waypoint
WaypointSnapshot = map_pb2.WaypointSnapshot


def graph_hash(graph: Graph) -> str:
    """The first 12 hexadecimal digits of the graph's SHA-256; the same on the robot and in a folder."""
    return hashlib.sha256(graph.SerializeToString(deterministic=True)).hexdigest()[:12]


def waypoint_ids(graph: Graph, wanted: Iterable[str]) -> tuple[dict[str, str], list[str], list[str]]:
    """The ids of waypoints by what they are called: their ids, or names that are unique.

    Returns:
        The ids of the wanted that the map has, the wanted that it does not have, and the names that several have.
    """
    ids = {waypoint.id for waypoint in graph.waypoints}
    named: dict[str, list[str]] = {}
    for waypoint in graph.waypoints:
        named.setdefault(waypoint.annotations.name, []).append(waypoint.id)
    known: dict[str, str] = {}
    missing: list[str] = []
    ambiguous: list[str] = []
    for name in sorted(set(wanted)):
        found = [name] if name in ids else named.get(name, [])
        if len(found) == 1:
            known[name] = found[0]
        else:
            (ambiguous if found else missing).append(name)
    return known, missing, ambiguous


def read_snapshot(folder: Path, waypoint: Waypoint) -> WaypointSnapshot | None:
    """A waypoint's snapshot in a map's folder; None where it is missing or damaged."""
    snapshot = WaypointSnapshot()
    try:
        snapshot.ParseFromString((folder / "waypoint_snapshots" / Path(waypoint.snapshot_id).name).read_bytes())
    except (OSError, DecodeError):
        return None
    return snapshot


def matrix(pose: Any) -> Floats:
    """A bosdyn.api.SE3Pose as a homogeneous matrix, shape (4, 4), metres."""
    return np.asarray(SE3Pose.from_proto(pose).to_matrix(), dtype=np.float64)
