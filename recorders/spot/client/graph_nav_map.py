"""Parts of a recorded GraphNav map as files: graph, waypoints, snapshots, and poses as matrices."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from enum import StrEnum
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from bosdyn.api.graph_nav import map_pb2
from bosdyn.client.math_helpers import SE3Pose
from google.protobuf.message import DecodeError

from workbench.arrays import Floats
from workbench.errors import MalformedFile
from workbench.worlds.geometry import MAX_COORDINATE_M

Graph = map_pb2.Graph
Waypoint = map_pb2.Waypoint
WaypointSnapshot = map_pb2.WaypointSnapshot
AGAIN = "Download the map from the robot again"
MAX_SECONDS = 1 << 36
"""Of the time when a waypoint was made: 2,178 years from 1970, either way."""


def require_sound(graph: Graph, file: Path) -> None:
    """Refuses what no map of a robot holds, such as places that are no numbers.

    Raises:
        MalformedFile: it names the file.
    """
    ids = [w.id for w in graph.waypoints]
    twice = next((i for i in ids if ids.count(i) > 1), None) if len(set(ids)) < len(ids) else None
    if twice is not None:
        raise MalformedFile(file, f"two waypoints have the id {twice!r}", AGAIN)
    of_edges = [(f"edge from {e.id.from_waypoint} to {e.id.to_waypoint}", e.from_tform_to) for e in graph.edges]
    of_waypoints = [(f"waypoint {w.id}", w.waypoint_tform_ko) for w in graph.waypoints]
    anchors = [(f"anchor of {a.id}", a.seed_tform_waypoint) for a in graph.anchoring.anchors]
    for what, pose in (*of_edges, *of_waypoints, *anchors):
        at, turn = pose.position, pose.rotation
        near = all(abs(metres) <= MAX_COORDINATE_M for metres in (at.x, at.y, at.z))
        if not near or not isfinite(turn.w + turn.x + turn.y + turn.z):
            raise MalformedFile(file, f"the pose of the {what} is no place within {MAX_COORDINATE_M:.0f} m", AGAIN)
    if any(abs(w.annotations.creation_time.seconds) >= MAX_SECONDS for w in graph.waypoints):
        raise MalformedFile(file, "a waypoint was made at no possible time", AGAIN)


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


class SnapshotFault(StrEnum):
    """Why a waypoint's snapshot cannot be used, or its points cannot."""

    MISSING = "missing"
    DAMAGED = "damaged"
    PACKED = "in another encoding of points"


def read_snapshot(folder: Path, waypoint: Waypoint) -> WaypointSnapshot | SnapshotFault:
    """A waypoint's snapshot in a map's folder, or why there is none. One of another id was damaged: bytes that are no
    snapshot often decode as a part of one."""
    snapshot = WaypointSnapshot()
    try:
        snapshot.ParseFromString((folder / "waypoint_snapshots" / Path(waypoint.snapshot_id).name).read_bytes())
    except FileNotFoundError:
        return SnapshotFault.MISSING
    except (OSError, DecodeError):
        return SnapshotFault.DAMAGED
    return snapshot if snapshot.id == waypoint.snapshot_id else SnapshotFault.DAMAGED


def matrix(pose: Any) -> Floats:
    """A bosdyn.api.SE3Pose as a homogeneous matrix, shape (4, 4), metres."""
    return np.asarray(SE3Pose.from_proto(pose).to_matrix(), dtype=np.float64)
