"""Foxglove messages of a run (map, scene, robot, path, text) for Foxglove, Lichtblick and Rerun.

Every scene message is complete, with stable entity ids, because a viewer that seeks to a time shows only the last
message of each topic.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import atan2, cos, sin

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

from workbench.belief_colours import belief_colours
from workbench.log_schema.events import NANO
from workbench.tolerances import ROUNDING
from workbench.worlds.floor_triangles import triangulated
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import Container, FloorPlan, Furniture, Room, Wall
from workbench.worlds.maps.occupancy import OccupancyGrid
from workbench.worlds.walls import THICKNESS_M, gaps_of, line_of, pieces_of, standing_walls

MAP_FRAME, ODOM_FRAME, BODY_FRAME = "map", "odom", "base_link"
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
        _entity("walls", at, cubes=[cube for wall in standing_walls(plan) for cube in _wall(wall, plan)]),
        *(
            _entity(f"furniture/{piece.id}", at, cubes=[_box(piece, OTHER_FLOOR)], facts={"type": piece.type})
            for piece in plan.furniture
        ),
        *(_container(box, at, sought, p.get(box.id), seen.get(box.id)) for box in plan.containers),
    ]
    return SceneUpdate(entities=entities)


def belief_colour(probability: float) -> Color:
    """The colour of the belief scale at the square root of a probability: 0.01 can be distinguished from 0 at a
    glance.

    The root, and not the share of the run's largest probability as in the dashboard: a live channel cannot know it.
    """
    r, g, b = belief_colours(min(max(probability, 0.0), 1.0) ** 0.5)
    return Color(r=_eighth_bits(r), g=_eighth_bits(g), b=_eighth_bits(b), a=0.9375)


def _eighth_bits(level: int) -> float:
    """A level from 0 to 255 as a binary fraction, which needs fewer bytes."""
    return round(int(level) / 255 * 128) / 128


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


def _wall(wall: Wall, plan: FloorPlan) -> list[CubePrimitive]:
    """The wall as boxes around its doors and windows."""
    line = line_of(wall)
    return [
        CubePrimitive(
            pose=_drawn(Pose(x_m=x, y_m=y, yaw_rad=line.yaw_rad), z),
            size=_vector(piece.end_m - piece.start_m, THICKNESS_M, piece.high_m - piece.low_m),
            color=WALLS,
        )
        for piece in pieces_of(line, gaps_of(wall, plan), top_m=wall.height_m)
        for x, y, z in [line.at((piece.start_m + piece.end_m) / 2, (piece.low_m + piece.high_m) / 2)]
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
