"""Drafts the survey of a place from a recording: stops, tags, walked path lengths and the map.

A robot driven round a place, standing a few seconds at each container, leaves what a survey needs: standing poses,
GraphNav waypoints, path lengths between them, tags and the map. Names and types stay for a person to fill in.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import atan2, cos, degrees, hypot, sin
from pathlib import Path

import numpy as np
import yaml
from foxglove_schemas_protobuf.Grid_pb2 import Grid
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from recorders.spot.client.localization import waypoint_of
from replayers.mcap_io.reader import messages
from replayers.runs.run import read
from replayers.sites.graph_lengths import lengths_between, near_pairs
from workbench.arrays import Floats
from workbench.errors import Unsupported
from workbench.files import make_folder, write_text
from workbench.log_schema.events import NANO
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import FloorPlan
from workbench.worlds.maps.occupancy import OccupancyGrid
from workbench.worlds.maps.rotated_grid import OCCUPIED_FROM, axis_aligned
from workbench.worlds.sites.ros_map import write_map

POSE, FIDUCIALS, MAP, LOCALIZATION = "/robot/pose", "/robot/fiducials", "/map", "/spot/localization"
DWELL_S, STILL_M = 3.0, 0.15
SAME_PLACE_M = 0.5
"""Stops closer than this are one place."""
JOIN_M = 0.35
"""Positions closer than this are joined when paths are measured: where the robot crossed its own path."""
ITEM_REACH_M = 1.8
"""A tag farther than this from every stop hangs on a wall or a dock: no item's."""
AHEAD_M = 0.7
"""A container is drafted this far ahead of where the robot stood."""
MARGIN_M = 1.5
GRAPH_EVERY_M = 0.15


class NothingToDraft(Unsupported):
    """A log that says nothing about a real place."""

    def __init__(self, path: Path, why: str) -> None:
        super().__init__(f"{path}: {why}. Record a localised robot with lios spot record, or import a bag with tf.")


@dataclass(frozen=True, slots=True, kw_only=True)
class DraftStop:
    """A place at which the robot stood still."""

    name: str
    pose: Pose
    seconds: float
    waypoint: str = ""
    kind: str = "Unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class SiteDraft:
    """The draft of a survey.

    Attributes:
        metres: path lengths between start and stops along what was walked; shape (1 + stops, 1 + stops), inf where
            the walked paths do not connect.
        start_waypoint: GraphNav's waypoint at the start.
        lengths_from: whose lengths metres are, where they are better than those of the map; "" to take the map's.
        drafted_from: what the file says of its origin.
        tags: number and mean position, in metres on the map, of each tag seen that may be an item's.
        other_tags: the same of tags that are none: the map's own fiducials, and what hangs where nothing stands.
    """

    start: Pose
    stops: tuple[DraftStop, ...]
    metres: Floats
    tags: dict[int, tuple[float, float, float]]
    corners: tuple[Point, Point]
    grid: OccupancyGrid | None
    other_tags: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    start_waypoint: str = ""
    lengths_from: str = ""
    drafted_from: str = "a recording by lios site from-log"


@dataclass(slots=True)
class _SessionData:
    stamps: list[int] = field(default_factory=list)
    poses: list[Pose] = field(default_factory=list)
    tags: dict[int, list[tuple[float, float, float]]] = field(default_factory=dict)
    waypoints: list[tuple[int, str | None]] = field(default_factory=list)
    grid: OccupancyGrid | None = None


def draft_site(path: Path, *, map_tags: frozenset[int] = frozenset()) -> SiteDraft:
    """Drafts the survey from a log.

    Args:
        map_tags: numbers of the map's own fiducials.

    Raises:
        FileMissing, MalformedFile: no log. NothingToDraft: no robot drove, it holds no poses, or the robot stood
            nowhere.
    """
    heard = _listen(path)
    if not heard.poses:
        raise NothingToDraft(path, f"no message on {POSE}, so the robot's path is unknown")
    run = read(path)
    if run.info.source in ("simulation", "replay"):
        raise NothingToDraft(path, f"a {run.info.source}, with no robot's session to draw a place from")
    stops = _stops(heard, run.place.plan)
    if not stops:
        raise NothingToDraft(
            path, f"the robot stood nowhere for {DWELL_S:g} s besides its start, so there is no stop"
        )
    xs, ys = [p.x_m for p in heard.poses], [p.y_m for p in heard.poses]
    low, high = (min(xs) - MARGIN_M, min(ys) - MARGIN_M), (max(xs) + MARGIN_M, max(ys) + MARGIN_M)
    points = [pose.point for pose in heard.poses]
    tags = {number: _mean(seen) for number, seen in sorted(heard.tags.items())}
    items = {number: at for number, at in tags.items() if number not in map_tags and _at_a_stop(at, stops)}
    return SiteDraft(
        start=heard.poses[0],
        stops=stops,
        metres=_walked_lengths(points, [points[0], *(stop.pose.point for stop in stops)]),
        tags=items,
        other_tags={number: at for number, at in tags.items() if number not in items},
        corners=(low, high),
        grid=heard.grid,
    )


def _at_a_stop(tag: tuple[float, float, float], stops: Iterable[DraftStop]) -> bool:
    """Whether a tag is where an item can be: within an arm's reach of a place at which the robot stood, and ahead."""
    for stop in stops:
        dx, dy = tag[0] - stop.pose.x_m, tag[1] - stop.pose.y_m
        ahead = cos(stop.pose.yaw_rad) * dx + sin(stop.pose.yaw_rad) * dy
        if hypot(dx, dy) <= ITEM_REACH_M and ahead > 0:
            return True
    return False


def write_draft(draft: SiteDraft, folder: Path, *, name: str) -> Path:
    """Writes site.yaml, travel.csv and the map of a draft; returns the site file. The folder must not hold a site."""
    make_folder(folder)
    if draft.grid is not None:
        write_map(draft.grid, folder / "map.yaml")
    names = ["start", *(stop.name for stop in draft.stops)]
    rows = [",".join([row, *(f"{metres:.2f}" for metres in draft.metres[i])]) for i, row in enumerate(names)]
    write_text(folder / "travel.csv", "\n".join([",".join(["", *names]), *rows]) + "\n")
    text = yaml.safe_dump(
        _as_file(draft, name), sort_keys=False, allow_unicode=True, width=110, default_flow_style=None
    )
    others = ", ".join(f"{number} at ({x:.1f}, {y:.1f})" for number, (x, y, _) in sorted(draft.other_tags.items()))
    left_out = f"# Tags left out, of the map, a wall or a dock: {others}.\n" if others else ""
    head = (
        f"# Drafted from {draft.drafted_from}. Name the containers, correct type, pose and size,\n"
        "# draw the rooms, and name the items that carry the tags. Then: lios site check site.yaml\n"
    )
    file = folder / "site.yaml"
    write_text(file, head + left_out + text)
    return file


def _as_file(draft: SiteDraft, name: str) -> dict[str, object]:
    (x0, y0), (x1, y1) = draft.corners
    floor = [[round(x, 2), round(y, 2)] for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    source = draft.lengths_from or ("" if draft.grid is not None else "walked in the recording")
    travel = {"travel": {"file": "travel.csv", "source": source}} if source else {}
    return {
        "lios_site": 1,
        "name": name,
        **({"map": "map.yaml"} if draft.grid is not None else {}),
        "start": _pose_entry(draft.start),
        **({"start_waypoint": draft.start_waypoint} if draft.start_waypoint else {}),
        "rooms": [{"id": "room", "kind": "Unknown", "floor": floor}],
        "containers": [_container_entry(stop) for stop in draft.stops],
        "tags": {number: {"item": f"Item|{number}", "type": "Unknown"} for number in draft.tags},
        **travel,
    }


def _container_entry(stop: DraftStop) -> dict[str, object]:
    yaw = stop.pose.yaw_rad
    ahead = Pose(x_m=stop.pose.x_m + cos(yaw) * AHEAD_M, y_m=stop.pose.y_m + sin(yaw) * AHEAD_M)
    return {
        "id": stop.name,
        "type": stop.kind,
        "room": "room",
        "pose": _pose_entry(ahead),
        "size_m": [0.6, 0.6, 0.8],
        "stand": _pose_entry(stop.pose),
        **({"waypoint": stop.waypoint} if stop.waypoint else {}),
    }


def _pose_entry(pose: Pose) -> dict[str, float]:
    return {"x_m": round(pose.x_m, 2), "y_m": round(pose.y_m, 2), "yaw_deg": round(degrees(pose.yaw_rad), 1)}


def _listen(path: Path) -> _SessionData:
    heard = _SessionData()
    for topic, stamp_ns, data in _of_topics(path, (POSE, FIDUCIALS, MAP, LOCALIZATION)):
        if topic == POSE:
            pose = PoseInFrame.FromString(data).pose
            heard.poses.append(Pose(x_m=pose.position.x, y_m=pose.position.y, yaw_rad=_yaw(pose.orientation)))
            heard.stamps.append(stamp_ns)
        elif topic == FIDUCIALS:
            for entity in SceneUpdate.FromString(data).entities:
                if entity.id.startswith("tag/") and entity.cubes:
                    at = entity.cubes[0].pose.position
                    heard.tags.setdefault(int(entity.id[4:]), []).append((at.x, at.y, at.z))
        elif topic == LOCALIZATION:
            heard.waypoints.append((stamp_ns, waypoint_of(data)))
        else:
            heard.grid = _grid(Grid.FromString(data))
    return heard


def _of_topics(path: Path, topics: tuple[str, ...]) -> Iterable[tuple[str, int, bytes]]:
    for message in messages(path, topics=lambda topic: topic in topics):
        yield message.topic, message.publish_time, message.data


def _grid(message: Grid) -> OccupancyGrid | None:
    columns = message.column_count
    cells = np.frombuffer(message.data, dtype=np.uint8)
    if not columns or message.cell_stride != 1 or cells.size % columns:
        return None
    return axis_aligned(
        cells.reshape(-1, columns) >= OCCUPIED_FROM,
        origin=(message.pose.position.x, message.pose.position.y),
        yaw_rad=_yaw(message.pose.orientation),
        resolution_m=message.cell_size.x,
    )


def _yaw(q: Quaternion) -> float:
    return atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))


def _stops(heard: _SessionData, plan: FloorPlan) -> tuple[DraftStop, ...]:
    """Where the robot stood for DWELL_S, revisited places counted once; the first pose is the start."""
    found: list[tuple[Pose, int, int]] = []
    first = 0
    for i in range(1, len(heard.poses) + 1):
        still = i < len(heard.poses) and _apart(heard.poses[i], heard.poses[first]) <= STILL_M
        if still:
            continue
        if heard.stamps[i - 1] - heard.stamps[first] >= DWELL_S * NANO:
            found.append((heard.poses[(first + i - 1) // 2], heard.stamps[first], heard.stamps[i - 1]))
        first = i
    stops: list[DraftStop] = []
    for pose, began, ended in found:
        if _apart(pose, heard.poses[0]) < SAME_PLACE_M or any(_apart(pose, s.pose) < SAME_PLACE_M for s in stops):
            continue
        name, kind = _known_as(pose, plan, len(stops) + 1)
        waypoints = [name for stamp, name in heard.waypoints if began <= stamp <= ended and name]
        stops.append(
            DraftStop(
                name=name,
                kind=kind,
                pose=pose,
                seconds=(ended - began) / NANO,
                waypoint=waypoints[-1] if waypoints else "",
            )
        )
    return tuple(stops)


def _known_as(pose: Pose, plan: FloorPlan, number: int) -> tuple[str, str]:
    """The container of the log's own place that the robot stood before; a new name otherwise."""
    for container in plan.containers:
        size = max(container.size_m[:2])
        if hypot(container.pose.x_m - pose.x_m, container.pose.y_m - pose.y_m) < size / 2 + 0.8:
            facing = atan2(container.pose.y_m - pose.y_m, container.pose.x_m - pose.x_m)
            if cos(facing - pose.yaw_rad) > 0.8:
                return container.id, container.type
    return f"container_{number}", "Unknown"


def _walked_lengths(points: list[Point], places: list[Point]) -> Floats:
    """Shortest lengths between places along the walked path, crossings joined; metres, shape (places, places)."""
    kept = [points[0]]
    for point in points[1:]:
        if hypot(point[0] - kept[-1][0], point[1] - kept[-1][1]) >= GRAPH_EVERY_M:
            kept.append(point)
    nodes = [*kept, *places]
    chain = [(i, i + 1) for i in range(len(kept) - 1)]
    edges = [
        (a, b, hypot(nodes[a][0] - nodes[b][0], nodes[a][1] - nodes[b][1]))
        for a, b in sorted({*chain, *near_pairs(nodes, JOIN_M)})
    ]
    return lengths_between(edges, range(len(kept), len(nodes)), nodes=len(nodes))


def _apart(a: Pose, b: Pose) -> float:
    return hypot(a.x_m - b.x_m, a.y_m - b.y_m)


def _mean(seen: list[tuple[float, float, float]]) -> tuple[float, float, float]:
    x, y, z = np.median(np.array(seen), axis=0)
    return float(x), float(y), float(z)
