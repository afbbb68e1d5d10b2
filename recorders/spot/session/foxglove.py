"""Conversion of bosdyn messages to Foxglove messages: transforms, poses, tags, images, grids.

Spot's body frame is REP-105's base_link; its GraphNav seed frame is the site's map. Quaternions are xyzw in both.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from bosdyn.api import geometry_pb2, image_pb2, local_grid_pb2, robot_state_pb2
from bosdyn.client.frame_helpers import BODY_FRAME_NAME, ODOM_FRAME_NAME, VISION_FRAME_NAME
from bosdyn.client.math_helpers import SE3Pose
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.Event_pb2 import Event
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Grid_pb2 import Grid
from foxglove_schemas_protobuf.KeyValuePair_pb2 import KeyValuePair
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.TextPrimitive_pb2 import TextPrimitive
from foxglove_schemas_protobuf.Vector2_pb2 import Vector2
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.duration_pb2 import Duration

from recorders.foxglove.scene import BODY_FRAME, MAP_FRAME, ODOM_FRAME, timestamp
from recorders.spot.client.frame_trees import tform
from recorders.spot.tags.detections import TagSighting
from recorders.spot.tags.lens import lens_of
from workbench.arrays import AnyArray, Bools, Floats32
from workbench.worlds.house import Item

TAG_LIFETIME_S = 2
BosdynPose = geometry_pb2.SE3Pose | SE3Pose
"""A pose as a protobuf message, or as the SDK's helper class."""
INK = Color(r=0.1, g=0.1, b=0.1, a=1.0)


def pose_message(pose: BosdynPose) -> Pose:
    """A bosdyn pose as a Foxglove pose."""
    helper = pose if isinstance(pose, SE3Pose) else SE3Pose.from_proto(pose)
    return Pose(
        position=Vector3(x=helper.x, y=helper.y, z=helper.z),
        orientation=Quaternion(x=helper.rot.x, y=helper.rot.y, z=helper.rot.z, w=helper.rot.w),
    )


def note_event(text: str, stamp_ns: int) -> Event:
    """A note as an instantaneous event."""
    at = timestamp(stamp_ns)
    pairs = [KeyValuePair(key="note", value=text), KeyValuePair(key="author", value="operator")]
    return Event(start_time=at, end_time=at, metadata=pairs)


def in_frame(pose: BosdynPose, frame: str, stamp_ns: int) -> PoseInFrame:
    return PoseInFrame(timestamp=timestamp(stamp_ns), frame_id=frame, pose=pose_message(pose))


def map_from_odom(map_tform_body: geometry_pb2.SE3Pose, snapshot: geometry_pb2.FrameTreeSnapshot) -> SE3Pose | None:
    """map_tform_odom, from a localisation and the frame tree of the same time."""
    body_tform_odom = tform(snapshot, BODY_FRAME_NAME, ODOM_FRAME_NAME)
    return None if body_tform_odom is None else SE3Pose.from_proto(map_tform_body).mult(body_tform_odom)


def transforms(
    snapshot: geometry_pb2.FrameTreeSnapshot, map_tform_odom: SE3Pose | None, stamp_ns: int
) -> FrameTransforms:
    """map -> odom -> base_link, and vision below odom; without map if the robot is not localised."""
    odom_tform_body = tform(snapshot, ODOM_FRAME_NAME, BODY_FRAME_NAME)
    odom_tform_vision = tform(snapshot, ODOM_FRAME_NAME, VISION_FRAME_NAME)
    links = (
        (MAP_FRAME, ODOM_FRAME, map_tform_odom),
        (ODOM_FRAME, BODY_FRAME, odom_tform_body),
        (ODOM_FRAME, "vision", odom_tform_vision),
    )
    return FrameTransforms(
        transforms=[_transform(parent, child, pose, stamp_ns) for parent, child, pose in links if pose is not None]
    )


def tag_scene(sightings: Sequence[TagSighting], items: dict[int, Item], stamp_ns: int) -> SceneUpdate:
    """A flat cube and a label per tag; an unknown tag shows its number."""
    return SceneUpdate(entities=[_tag(seen, items.get(seen.tag), stamp_ns) for seen in sightings])


def picture(shot: image_pb2.ImageCapture, stamp_ns: int) -> CompressedImage | None:
    """A camera's JPEG, unchanged; None for other formats."""
    if shot.image.format != shot.image.FORMAT_JPEG:
        return None
    return CompressedImage(
        timestamp=timestamp(stamp_ns), frame_id=shot.frame_name_image_sensor, data=shot.image.data, format="jpeg"
    )


def camera_link(shot: image_pb2.ImageCapture, stamp_ns: int) -> FrameTransforms | None:
    """The transform from body to camera at the time of the image; None without frames."""
    name = shot.frame_name_image_sensor
    pose = tform(shot.transforms_snapshot, BODY_FRAME_NAME, name) if name else None
    return None if pose is None else FrameTransforms(transforms=[_transform(BODY_FRAME, name, pose, stamp_ns)])


def calibration(source: image_pb2.ImageSource, shot: image_pb2.ImageCapture, stamp_ns: int) -> CameraCalibration:
    """The pinhole calibration of a camera, scaled to the image size, without distortion."""
    lens = lens_of(source, shot.image.cols, shot.image.rows)
    return CameraCalibration(
        timestamp=timestamp(stamp_ns),
        frame_id=shot.frame_name_image_sensor,
        width=shot.image.cols,
        height=shot.image.rows,
        K=[lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1],
        R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
        P=[lens.fx, 0, lens.cx, 0, 0, lens.fy, lens.cy, 0, 0, 0, 1, 0],
    )


def local_grid(grid: local_grid_pb2.LocalGrid, stamp_ns: int) -> Grid | None:
    """A local grid in odom, its values in metres (obstacle_distance); None if it cannot be placed or decoded."""
    corner = tform(grid.transforms_snapshot, ODOM_FRAME_NAME, grid.frame_name_local_grid_data)
    values = grid_values(grid)
    if corner is None or values is None:
        return None
    columns = values.shape[1]
    return Grid(
        timestamp=timestamp(stamp_ns),
        frame_id=ODOM_FRAME,
        pose=pose_message(corner),
        column_count=columns,
        cell_size=Vector2(x=grid.extent.cell_size, y=grid.extent.cell_size),
        row_stride=columns * 4,
        cell_stride=4,
        fields=[PackedElementField(name=grid.local_grid_type_name, offset=0, type=PackedElementField.FLOAT32)],
        data=np.ascontiguousarray(values, dtype="<f4").tobytes(),
    )


def grid_values(grid: local_grid_pb2.LocalGrid) -> Floats32 | None:
    """A bosdyn local grid as an array of shape (cells along y, cells along x); None if its data has the wrong size.

    Cells that the robot lists as unknown (`unknown_cells`, since SDK 5.2) are NaN.
    """
    kind = _CELLS.get(grid.cell_format)
    cells = grid.extent.num_cells_x * grid.extent.num_cells_y
    if kind is None or len(grid.data) % np.dtype(kind).itemsize:
        return None
    values = _unpacked(grid, np.frombuffer(grid.data, dtype=kind), cells)
    if values is None:
        return None
    scaled = values.astype(np.float32) * (grid.cell_value_scale or 1.0) + grid.cell_value_offset
    scaled[_unknown(grid, cells)] = np.nan
    return scaled.reshape(grid.extent.num_cells_y, grid.extent.num_cells_x)


def _unknown(grid: local_grid_pb2.LocalGrid, cells: int) -> Bools:
    """Which cells are unknown, shape (cells,), from a field whose encoding the SDK does not state.

    It has a byte a cell, a byte a run of a run-length encoded grid, or a bit a cell from either end of each byte. A
    cell is unknown if it is by any of these that the field's length allows; by a length of none of them, all are.
    """
    marks = np.frombuffer(getattr(grid, "unknown_cells", b""), dtype=np.uint8)
    unknown = np.zeros(cells, dtype=np.bool_)
    if not len(marks):
        return unknown
    readings: list[AnyArray | None] = [marks if len(marks) == cells else None]
    if grid.encoding == grid.ENCODING_RLE:
        readings.append(_unpacked(grid, marks, cells))
    if len(marks) == -(-cells // 8):
        readings += [np.unpackbits(marks, count=cells, bitorder=order) for order in ("little", "big")]
    known = [reading for reading in readings if reading is not None]
    for reading in known:
        unknown |= reading != 0
    return unknown if known else np.ones(cells, dtype=np.bool_)


def _unpacked(grid: local_grid_pb2.LocalGrid, values: AnyArray, cells: int) -> AnyArray | None:
    """A value a cell, runs of a run-length encoded grid repeated; None if there are more or fewer than its cells."""
    if grid.encoding == grid.ENCODING_RLE:
        counts = np.array(grid.rle_counts, dtype=np.int64)
        if len(counts) != len(values) or (counts < 0).any() or counts.sum() != cells:
            return None
        values = np.repeat(values, counts)
    return values if len(values) == cells else None


def faults_of(state: robot_state_pb2.RobotState) -> tuple[str, ...]:
    """The robot's fault messages, sorted."""
    system = (f"{f.name}: {f.error_message}" for f in state.system_fault_state.faults)
    behaviour = (f"behaviour fault {f.behavior_fault_id}" for f in state.behavior_fault_state.faults)
    service = (f"{f.fault_id.fault_name}: {f.error_message}" for f in state.service_fault_state.faults)
    return tuple(sorted({*system, *behaviour, *service}))


def without_pixels(response: image_pb2.ImageResponse) -> image_pb2.ImageResponse:
    """An image response without pixel data, which is stored elsewhere in the same log."""
    bare = image_pb2.ImageResponse()
    bare.CopyFrom(response)
    bare.shot.image.ClearField("data")
    return bare


def _tag(seen: TagSighting, item: Item | None, stamp_ns: int) -> SceneEntity:
    x, y, z = seen.position
    side_m = seen.detection.size_m
    label = f"tag {seen.tag}" if item is None else f"{item.type} ({seen.tag})"
    at = Pose(position=Vector3(x=x, y=y, z=z), orientation=Quaternion(w=1.0))
    above = Pose(position=Vector3(x=x, y=y, z=z + 0.25), orientation=Quaternion(w=1.0))
    facts = {"tag": str(seen.tag), "item": "" if item is None else item.id}
    return SceneEntity(
        timestamp=timestamp(stamp_ns),
        frame_id=MAP_FRAME,
        id=f"tag/{seen.tag}",
        lifetime=Duration(seconds=TAG_LIFETIME_S),
        metadata=[KeyValuePair(key=key, value=value) for key, value in facts.items()],
        cubes=[CubePrimitive(pose=at, size=Vector3(x=side_m, y=side_m, z=0.02), color=INK)],
        texts=[TextPrimitive(pose=above, billboard=True, font_size=12, scale_invariant=True, color=INK, text=label)],
    )


def _transform(parent: str, child: str, pose: SE3Pose, stamp_ns: int) -> FrameTransform:
    message = pose_message(pose)
    return FrameTransform(
        timestamp=timestamp(stamp_ns),
        parent_frame_id=parent,
        child_frame_id=child,
        translation=message.position,
        rotation=message.orientation,
    )


_CELLS = {1: "<f4", 2: "<f8", 3: "<i1", 4: "<u1", 5: "<i2", 6: "<u2"}
"""numpy types of bosdyn.api.LocalGrid.CellFormat."""
