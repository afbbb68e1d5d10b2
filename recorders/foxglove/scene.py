"""Foxglove messages of a run (map, scene, robot, path, text) for Foxglove, Lichtblick and Rerun.

Every scene message is complete, with stable entity ids, because a viewer that seeks to a time shows only the last
message of each topic.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import atan2, cos, hypot, sin

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Grid_pb2 import Grid
from foxglove_schemas_protobuf.KeyValuePair_pb2 import KeyValuePair
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose as PoseMessage
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive
from foxglove_schemas_protobuf.Vector2_pb2 import Vector2
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.duration_pb2 import Duration
from google.protobuf.timestamp_pb2 import Timestamp

from workbench.log_schema.events import NANO
from workbench.tolerances import MIN_LENGTH_M, ROUNDING
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import Container, FloorPlan, Furniture, Room, Wall
from workbench.worlds.maps.occupancy import OccupancyGrid

MAP_FRAME, ODOM_FRAME, BODY_FRAME = "map", "odom", "base_link"
WALL_M = 0.08
FINE = 1024
"""Scene coordinates are rounded to 1/1024 m: this is invisible, and binary fractions halve the size of a log."""
SEARCHED = Color(r=0.625, g=0.625, b=0.625, a=0.5)
UNKNOWN = Color(r=0.875, g=0.8125, b=0.75, a=0.875)
WALLS = Color(r=0.875, g=0.875, b=0.875, a=0.5)
FLOORS: Mapping[str, Color] = {
    "Kitchen": Color(r=0.98, g=0.91, b=0.80, a=1.0),
    "Bedroom": Color(r=0.84, g=0.88, b=0.96, a=1.0),
    "Bathroom": Color(r=0.83, g=0.95, b=0.93, a=1.0),
    "LivingRoom": Color(r=0.90, g=0.94, b=0.84, a=1.0),
}
OTHER_FLOOR = Color(r=0.93, g=0.93, b=0.93, a=1.0)
BELIEF_STOPS = ((0.27, 0.00, 0.33), (0.23, 0.32, 0.55), (0.13, 0.57, 0.55), (0.37, 0.79, 0.38), (0.99, 0.91, 0.14))
"""Viridis at 0, 1/4, 1/2, 3/4 and 1, over the square root of the probability."""


def timestamp(stamp_ns: int) -> Timestamp:
    return Timestamp(seconds=stamp_ns // NANO, nanos=stamp_ns % NANO)


def map_grid(occupancy: OccupancyGrid, stamp_ns: int, *, yaw_rad: float = 0.0) -> Grid:
    """The occupancy grid with one byte per cell: 0 free, 100 occupied; rows turned by yaw_rad about its origin."""
    cells = occupancy.occupied.astype(np.uint8) * 100
    return Grid(
        timestamp=timestamp(stamp_ns),
        frame_id=MAP_FRAME,
        pose=_pose(Pose(x_m=occupancy.origin[0], y_m=occupancy.origin[1], yaw_rad=yaw_rad), -0.01),
        column_count=cells.shape[1],
        cell_size=Vector2(x=occupancy.resolution_m, y=occupancy.resolution_m),
        row_stride=cells.shape[1],
        cell_stride=1,
        fields=[PackedElementField(name="occupancy", offset=0, type=PackedElementField.UINT8)],
        data=cells.tobytes(),
    )


def scene(
    plan: FloorPlan,
    stamp_ns: int,
    *,
    sought: str = "",
    probability: Mapping[str, float] | None = None,
    searched: Mapping[str, Sequence[str]] | None = None,
) -> SceneUpdate:
    """The complete scene: rooms, walls, furniture, and containers coloured by the belief about the item sought.

    Args:
        sought: the item type of the belief; "" for none.
        probability: probability of the item in each unsearched container.
        searched: the item types in each searched container.
    """
    at, p, seen = timestamp(stamp_ns), probability or {}, searched or {}
    entities = [
        *(_entity(f"room/{room.id}", at, triangles=[_floor(room)], facts={"kind": room.kind}) for room in plan.rooms),
        _entity("walls", at, cubes=[cube for wall in plan.walls if not wall.empty for cube in _wall(wall, plan)]),
        *(
            _entity(f"furniture/{piece.id}", at, cubes=[_box(piece, OTHER_FLOOR)], facts={"type": piece.type})
            for piece in plan.furniture
        ),
        *(_container(box, at, sought, p.get(box.id), seen.get(box.id)) for box in plan.containers),
    ]
    return SceneUpdate(entities=entities)


def belief_colour(probability: float) -> Color:
    """A colour from dark violet (0) to yellow (1)."""
    at = min(max(probability, 0.0), 1.0) ** 0.5 * (len(BELIEF_STOPS) - 1)
    low = min(int(at), len(BELIEF_STOPS) - 2)
    share = at - low
    r, g, b = (
        round((a + (z - a) * share) * 128) / 128
        for a, z in zip(BELIEF_STOPS[low], BELIEF_STOPS[low + 1], strict=True)
    )
    return Color(r=r, g=g, b=b, a=0.9375)


def robot_pose(pose: Pose, stamp_ns: int) -> PoseInFrame:
    return PoseInFrame(timestamp=timestamp(stamp_ns), frame_id=MAP_FRAME, pose=_pose(pose))


def robot_transforms(pose: Pose, stamp_ns: int) -> FrameTransforms:
    """map -> odom -> base_link; odom coincides with map in simulation."""
    at, here = timestamp(stamp_ns), _pose(pose)
    still = FrameTransform(
        timestamp=at,
        parent_frame_id=MAP_FRAME,
        child_frame_id=ODOM_FRAME,
        translation=Vector3(),
        rotation=Quaternion(w=1.0),
    )
    body = FrameTransform(
        timestamp=at,
        parent_frame_id=ODOM_FRAME,
        child_frame_id=BODY_FRAME,
        translation=here.position and Vector3(x=here.position.x, y=here.position.y, z=here.position.z),
        rotation=here.orientation,
    )
    return FrameTransforms(transforms=[still, body])


def path_ahead(points: Iterable[Point], stamp_ns: int) -> PosesInFrame:
    """The planned path as poses that face along it."""
    return PosesInFrame(
        timestamp=timestamp(stamp_ns), frame_id=MAP_FRAME, poses=[_pose(pose) for pose in facing(list(points))]
    )


def words(text: str, stamp_ns: int, *, level: Log.Level.ValueType = Log.INFO, name: str = "lios") -> Log:
    return Log(timestamp=timestamp(stamp_ns), level=level, message=text, name=name)


def facing(points: Sequence[Point]) -> list[Pose]:
    """Poses along a polyline, each facing the next point; the last keeps its direction."""
    poses: list[Pose] = []
    yaw = 0.0
    for i, (x, y) in enumerate(points):
        if i + 1 < len(points) and points[i + 1] != points[i]:
            yaw = atan2(points[i + 1][1] - y, points[i + 1][0] - x)
        poses.append(Pose(x_m=x, y_m=y, yaw_rad=yaw))
    return poses


def _container(
    box: Container, at: Timestamp, sought: str, probability: float | None, held: Sequence[str] | None
) -> SceneEntity:
    colour = SEARCHED if held is not None else UNKNOWN if probability is None else belief_colour(probability)
    label = box.type if probability is None or held is not None else f"{box.type} {probability:.2f}"
    text = TextPrimitive(
        pose=_drawn(box.pose, box.base_m + box.size_m[2] + 0.2),
        billboard=True,
        font_size=12.0,
        scale_invariant=True,
        color=Color(r=0.1, g=0.1, b=0.1, a=1.0),
        text=label,
    )
    facts = {"type": box.type, "room": box.room, "searched": "no" if held is None else "yes"}
    if held is not None:
        facts["held"] = ", ".join(held) or "nothing"
    elif probability is not None:
        facts["sought"], facts["probability"] = sought, f"{probability:.4f}"
    return _entity(f"container/{box.id}", at, cubes=[_box(box, colour)], texts=[text], facts=facts)


def _entity(
    name: str,
    at: Timestamp,
    *,
    cubes: Iterable[CubePrimitive] = (),
    triangles: Iterable[TriangleListPrimitive] = (),
    texts: Iterable[TextPrimitive] = (),
    facts: Mapping[str, str] | None = None,
) -> SceneEntity:
    return SceneEntity(
        timestamp=at,
        frame_id=MAP_FRAME,
        id=name,
        lifetime=Duration(),
        metadata=[KeyValuePair(key=key, value=value) for key, value in (facts or {}).items()],
        cubes=cubes,
        triangles=triangles,
        texts=texts,
    )


def _box(piece: Container | Furniture, colour: Color) -> CubePrimitive:
    x, y, z = piece.size_m
    return CubePrimitive(pose=_drawn(piece.pose, piece.base_m + z / 2), size=_vector(x, y, z), color=colour)


def _floor(room: Room) -> TriangleListPrimitive:
    corners = [Point3(x=round(x * FINE) / FINE, y=round(y * FINE) / FINE, z=0.0) for x, y in room.floor]
    return TriangleListPrimitive(
        pose=_pose(Pose(x_m=0.0, y_m=0.0), -0.02),
        points=corners,
        indices=[i for triangle in triangulated(room.floor) for i in triangle],
        color=FLOORS.get(room.kind, OTHER_FLOOR),
    )


def triangulated(floor: Sequence[Point]) -> list[tuple[int, int, int]]:
    """Triangles of a simple polygon, by cutting ears; indices into its corners.

    Not shapely's triangles: they come in another order, and the bytes of a log would change from one release of its
    library (GEOS) to the next.
    """
    left = list(range(len(floor)))
    if _turn_sum(floor) < 0:
        left.reverse()
    triangles: list[tuple[int, int, int]] = []
    while len(left) > 3:
        ear = next((k for k in range(len(left)) if _is_ear(floor, left, k)), None)
        if ear is None:  # a self-intersecting polygon: draw the rest as a fan
            break
        triangles.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        left.pop(ear)
    return triangles + [(left[0], left[k], left[k + 1]) for k in range(1, len(left) - 1)]


def _is_ear(floor: Sequence[Point], left: list[int], k: int) -> bool:
    a, b, c = floor[left[k - 1]], floor[left[k]], floor[left[(k + 1) % len(left)]]
    if _cross(a, b, c) <= 0:
        return False
    others = (floor[i] for i in left if floor[i] not in (a, b, c))
    return not any(_cross(a, b, p) >= 0 and _cross(b, c, p) >= 0 and _cross(c, a, p) >= 0 for p in others)


def _cross(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _turn_sum(floor: Sequence[Point]) -> float:
    return sum(floor[i - 1][0] * floor[i][1] - floor[i][0] * floor[i - 1][1] for i in range(len(floor)))


def _wall(wall: Wall, plan: FloorPlan) -> list[CubePrimitive]:
    """The wall as boxes around its doors and windows."""
    (x0, y0), (x1, y1) = wall.start, wall.end
    length = hypot(x1 - x0, y1 - y0)
    if length < MIN_LENGTH_M:
        return []
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    holes: list[tuple[float, float, float, float]] = []
    for hole in (*plan.doors, *plan.windows):
        along = [(px - x0) * ux + (py - y0) * uy for px, py in (hole.start, hole.end)]
        away = [abs((py - y0) * ux - (px - x0) * uy) for px, py in (hole.start, hole.end)]
        low, high = max(min(along), 0.0), min(max(along), length)
        if max(away) < 0.1 and high - low > 0.05:
            holes.append((low, high, hole.bottom_m, min(hole.top_m, wall.height_m)))
    parts: list[tuple[float, float, float, float]] = []
    at = 0.0
    for low, high, bottom, top in sorted(holes):
        if low > at:
            parts.append((at, low, 0.0, wall.height_m))
        parts.extend((low, high, b, t) for b, t in ((0.0, bottom), (top, wall.height_m)) if t - b > 0.01)
        at = max(at, high)
    if length > at:
        parts.append((at, length, 0.0, wall.height_m))
    yaw = atan2(uy, ux)
    return [
        CubePrimitive(
            pose=_drawn(Pose(x_m=x0 + ux * (a + b) / 2, y_m=y0 + uy * (a + b) / 2, yaw_rad=yaw), (low + high) / 2),
            size=_vector(b - a, WALL_M, high - low),
            color=WALLS,
        )
        for a, b, low, high in parts
    ]


def _pose(pose: Pose, z_m: float = 0.0) -> PoseMessage:
    """A pose without rounding, for the robot."""
    return PoseMessage(
        position=Vector3(x=pose.x_m, y=pose.y_m, z=z_m),
        orientation=Quaternion(x=0.0, y=0.0, z=sin(pose.yaw_rad / 2), w=cos(pose.yaw_rad / 2)),
    )


def _drawn(pose: Pose, z_m: float = 0.0) -> PoseMessage:
    """A pose rounded to 1/FINE, for drawing."""
    z, w = sin(pose.yaw_rad / 2), cos(pose.yaw_rad / 2)
    return PoseMessage(
        position=_vector(pose.x_m, pose.y_m, z_m),
        orientation=Quaternion(x=0.0, y=0.0, z=z, w=w) if _turned(pose) else Quaternion(z=round(z), w=round(w)),
    )


def _turned(pose: Pose) -> bool:
    """Whether the pose is rotated by anything but 0 or 180 degrees."""
    return abs(sin(pose.yaw_rad)) > ROUNDING


def _vector(x: float, y: float, z: float) -> Vector3:
    return Vector3(x=round(x * FINE) / FINE, y=round(y * FINE) / FINE, z=round(z * FINE) / FINE)
