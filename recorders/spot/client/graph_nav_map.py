"""Parts of a recorded GraphNav map as files: graph, waypoints, snapshots, and poses as matrices."""

from __future__ import annotations

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
