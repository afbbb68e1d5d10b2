"""Drafts the survey of a place from the folder of a recorded GraphNav map: waypoints, edges, tags and point clouds.

Poses are those of the map's anchoring where every waypoint has one, else chained along the edges from the first
waypoint. A snapshot's points and tags are in the odometry frame of its moment (ko), which the waypoint places.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from replayers.sites.graph_lengths import lengths_between
from replayers.sites.survey_draft import MARGIN_M, DraftStop, NothingToDraft, SiteDraft
from workbench.arrays import Bools, Floats
from workbench.errors import MissingExtra
from workbench.worlds.geometry import Pose
from workbench.worlds.maps.clearance import closed_gaps, distances_to
from workbench.worlds.maps.occupancy import MAX_CELLS, OccupancyGrid

if TYPE_CHECKING:
    from recorders.spot.client.graph_nav_map import Graph, SnapshotFault, Waypoint, WaypointSnapshot

Poses = dict[str, Floats]
"""seed_tform_waypoint by waypoint id, shape (4, 4), metres."""

RESOLUTION_M = 0.05
BODY_HEIGHT_M = 0.5
"""Height of the body, and so of a waypoint, above the floor while a map is recorded."""
FLOOR_WITHIN_M = 0.15
"""Points this close to the floor are floor."""
OBSTACLE_UP_TO_M = 1.2
"""Points from the floor's to this height are what a robot runs into."""
WALKED_WITHIN_M = 0.35
"""Ground this close to an edge was walked on, and is free."""
XYZ_32F = 1
"""PointCloud.ENCODING_XYZ_32F of bosdyn.api."""
UNNAMED = re.compile(r"(waypoint|default)[_ ]?\d*|")
"""Names that the tablet gives to waypoints by itself."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GraphNavDraft:
    """A draft, and what of the map it leaves out.

    Attributes:
        waypoints, edges: how many the map has.
        disconnected: waypoints that no edge connects with the start.
        unread: waypoints whose snapshots, or the points in these, could not be read, and why.
        named_only: whether only waypoints with a name of their own became containers.
    """

    draft: SiteDraft
    waypoints: int
    edges: int
    disconnected: tuple[str, ...]
    unread: Mapping[str, SnapshotFault]
    named_only: bool


def draft_from_graph_nav(folder: Path) -> GraphNavDraft:
    """Drafts the survey from a GraphNav folder (graph, waypoint_snapshots).

    The first waypoint that was made is the start; the others become containers, or only those that were given a name.

    Raises:
        MissingExtra: the Spot SDK is not installed. FileMissing, MalformedFile: no GraphNav map.
        NothingToDraft: it has one waypoint only.
    """
    try:
        from recorders.spot.client.map_upload import read_graph
    except ImportError as error:
        raise MissingExtra("Reading GraphNav maps", "spot") from error
    graph = read_graph(folder)
    ordered = sorted(graph.waypoints, key=lambda w: (w.annotations.creation_time.ToNanoseconds(), w.id))
    start = ordered[0]
    anchored = _anchored(graph)
    poses = anchored or _chained(graph, start.id)
    there = [w for w in ordered if w.id in poses]
    if len(there) < 2:
        raise NothingToDraft(folder, "its start is connected with no other waypoint")
    named = [w for w in there[1:] if not UNNAMED.fullmatch(w.annotations.name)]
    stops = _stops(named or there[1:], poses)
    clouds, tags, unread = _snapshots(folder, there, poses)
    path = [poses[w.id][:3, 3] for w in there]
    low, high = np.min(path, axis=0)[:2] - MARGIN_M, np.max(path, axis=0)[:2] + MARGIN_M
    draft = SiteDraft(
        start=_pose(poses[start.id]),
        start_waypoint=start.id,
        stops=stops,
        metres=_lengths(graph, [start.id, *(stop.waypoint for stop in stops)]),
        tags={},  # a robot finds itself by the map's tags, so none of them is an item's
        other_tags=tags | (_anchored_tags(graph) if anchored else {}),
        corners=((float(low[0]), float(low[1])), (float(high[0]), float(high[1]))),
        grid=_grid(graph, poses, clouds) if clouds else None,
        lengths_from="GraphNav's edges",
        drafted_from="a GraphNav map by lios site from-graph-nav",
    )
    return GraphNavDraft(
        draft=draft,
        waypoints=len(ordered),
        edges=len(graph.edges),
        disconnected=tuple(w.id for w in ordered if w.id not in poses),
        unread=unread,
        named_only=bool(named),
    )


def _anchored(graph: Graph) -> Poses:
    """Poses by the map's anchoring; none where a waypoint has no anchor."""
    anchors = {anchor.id: _matrix(anchor.seed_tform_waypoint) for anchor in graph.anchoring.anchors}
    return anchors if {w.id for w in graph.waypoints} <= anchors.keys() else {}


def _anchored_tags(graph: Graph) -> dict[int, tuple[float, float, float]]:
    """Places of tags by the anchoring, which has weighed all sightings; its objects are named by their numbers."""
    places = {o.id: o.seed_tform_object.position for o in graph.anchoring.objects if o.id.isdecimal()}
    return {int(name): (place.x, place.y, place.z) for name, place in sorted(places.items())}


def _chained(graph: Graph, start: str) -> Poses:
    """Poses along edges from the start, nearest by number of edges first."""
    beside: dict[str, list[tuple[str, Floats]]] = {}
    for edge in graph.edges:
        a, b, a_tform_b = edge.id.from_waypoint, edge.id.to_waypoint, _matrix(edge.from_tform_to)
        beside.setdefault(a, []).append((b, a_tform_b))
        beside.setdefault(b, []).append((a, np.asarray(np.linalg.inv(a_tform_b), dtype=np.float64)))
    known = {w.id for w in graph.waypoints}
    poses: Poses = {start: np.eye(4)}
    queue: list[str] = [start]
    for at in queue:
        for other, step in beside.get(at, ()):
            if other in known and other not in poses:
                poses[other] = np.asarray(poses[at] @ step, dtype=np.float64)
                queue.append(other)
    return poses


def _stops(waypoints: list[Waypoint], poses: Poses) -> tuple[DraftStop, ...]:
    stops: list[DraftStop] = []
    taken = {"start"}
    for waypoint in waypoints:
        base = re.sub(r"\W+", "_", waypoint.annotations.name).strip("_")[:100] or "waypoint"
        name, number = base, 2
        while name in taken:
            name, number = f"{base}_{number}", number + 1
        taken.add(name)
        stops.append(DraftStop(name=name, pose=_pose(poses[waypoint.id]), seconds=0.0, waypoint=waypoint.id))
    return tuple(stops)


def _lengths(graph: Graph, places: list[str]) -> Floats:
    """Shortest lengths along edges, metres, shape (places, places); inf where none connects."""
    number = {waypoint.id: i for i, waypoint in enumerate(graph.waypoints)}
    known = [e for e in graph.edges if e.id.from_waypoint in number and e.id.to_waypoint in number]
    ends = [(number[e.id.from_waypoint], number[e.id.to_waypoint]) for e in known]
    lengths = [float(np.linalg.norm(_matrix(e.from_tform_to)[:2, 3])) for e in known]
    edges = [(a, b, length) for (a, b), length in zip(ends, lengths, strict=True)]
    return lengths_between(edges, [number[place] for place in places], nodes=len(number))


def _snapshots(
    folder: Path, waypoints: list[Waypoint], poses: Poses
) -> tuple[list[Floats], dict[int, tuple[float, float, float]], dict[str, SnapshotFault]]:
    """Points on the map, z from the floor, shape (points, 3) a snapshot; tags' places; waypoints of the unread."""
    from recorders.spot.client.graph_nav_map import SnapshotFault, read_snapshot

    clouds: list[Floats] = []
    seen: dict[int, list[Floats]] = {}
    unread: dict[str, SnapshotFault] = {}
    for waypoint in waypoints:
        snapshot = read_snapshot(folder, waypoint)
        if isinstance(snapshot, SnapshotFault):
            unread[waypoint.id] = snapshot
            continue
        seed_tform_ko = poses[waypoint.id] @ _matrix(waypoint.waypoint_tform_ko)
        for number, ko_tform_tag in _tags_in(snapshot):
            seen.setdefault(number, []).append((seed_tform_ko @ ko_tform_tag)[:3, 3])
        points = _points_in(snapshot)
        if points is None:
            unread[waypoint.id] = SnapshotFault.PACKED
            continue
        placed = points @ seed_tform_ko[:3, :3].T + seed_tform_ko[:3, 3]
        placed[:, 2] -= poses[waypoint.id][2, 3] - BODY_HEIGHT_M
        clouds.append(placed)
    tags: dict[int, tuple[float, float, float]] = {}
    for number, places in sorted(seen.items()):
        x, y, z = np.median(np.array(places), axis=0)
        tags[number] = (float(x), float(y), float(z))
    return clouds, tags, unread


def _tags_in(snapshot: WaypointSnapshot) -> list[tuple[int, Floats]]:
    """Tags of a snapshot with their pose in its odometry frame."""
    from recorders.spot.client.frame_trees import tform

    found: list[tuple[int, Floats]] = []
    for seen in snapshot.objects:
        if not seen.HasField("apriltag_properties"):
            continue
        properties = seen.apriltag_properties
        pose = tform(seen.transforms_snapshot, "odom", properties.frame_name_fiducial)
        if pose is not None:
            found.append((int(properties.tag_id), np.asarray(pose.to_matrix(), dtype=np.float64)))
    return found


def _points_in(snapshot: WaypointSnapshot) -> Floats | None:
    """Points of a snapshot in its odometry frame, shape (points, 3); None for another encoding."""
    from recorders.spot.client.frame_trees import tform

    cloud = snapshot.point_cloud
    pose = tform(cloud.source.transforms_snapshot, "odom", cloud.source.frame_name_sensor)
    if cloud.encoding != XYZ_32F or pose is None or len(cloud.data) % 12:
        return None
    points = np.frombuffer(cloud.data, dtype="<f4").reshape(-1, 3).astype(np.float64)
    points = points[np.isfinite(points).all(axis=1)]
    matrix = np.asarray(pose.to_matrix(), dtype=np.float64)
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _grid(graph: Graph, poses: Poses, clouds: list[Floats]) -> OccupancyGrid | None:
    """The map: free is floor that was seen or walked on, without an obstacle over it; the rest is unsurveyed.

    None where its extent exceeds MAX_CELLS.
    """
    points = np.concatenate(clouds)
    walked = _walked(graph, poses)
    low = np.floor((np.min(walked, axis=0) - 2 * MARGIN_M) / RESOLUTION_M) * RESOLUTION_M
    high = np.max(walked, axis=0) + 2 * MARGIN_M
    columns, rows = (int(n) for n in np.ceil((high - low) / RESOLUTION_M))
    if columns * rows > MAX_CELLS:
        return None
    inside = ((points[:, :2] >= low) & (points[:, :2] < low + np.array([columns, rows]) * RESOLUTION_M)).all(axis=1)
    points = points[inside]

    def marked(where: Floats) -> Bools:
        cells = ((where[:, :2] - low) / RESOLUTION_M).astype(np.int64)
        grid = np.zeros((rows, columns), dtype=np.bool_)
        grid[cells[:, 1], cells[:, 0]] = True
        return grid

    height = points[:, 2]
    floor = closed_gaps(marked(points[np.abs(height) <= FLOOR_WITHIN_M]), 3)
    obstacle = marked(points[(height > FLOOR_WITHIN_M) & (height <= OBSTACLE_UP_TO_M)])
    away = distances_to(marked(walked), within=WALKED_WITHIN_M / RESOLUTION_M + 1)
    on_foot = away * RESOLUTION_M <= WALKED_WITHIN_M
    free = on_foot | (floor & ~obstacle)
    return OccupancyGrid(origin=(float(low[0]), float(low[1])), resolution_m=RESOLUTION_M, occupied=~free)


def _walked(graph: Graph, poses: Poses) -> Floats:
    """Points along all edges, closer together than a cell; shape (points, 2)."""
    parts = [np.array([pose[:2, 3] for pose in poses.values()])]
    for edge in graph.edges:
        if edge.id.from_waypoint in poses and edge.id.to_waypoint in poses:
            a, b = poses[edge.id.from_waypoint][:2, 3], poses[edge.id.to_waypoint][:2, 3]
            count = 2 + int(min(10_000.0, float(np.linalg.norm(b - a)) / RESOLUTION_M))
            parts.append(np.linspace(a, b, count))
    return np.concatenate(parts)


def _matrix(pose: Any) -> Floats:
    """A bosdyn.api.SE3Pose as a matrix, shape (4, 4)."""
    from recorders.spot.client.graph_nav_map import matrix

    return matrix(pose)


def _pose(matrix: Floats) -> Pose:
    yaw = atan2(float(matrix[1, 0]), float(matrix[0, 0]))
    return Pose(x_m=float(matrix[0, 3]), y_m=float(matrix[1, 3]), yaw_rad=yaw)
