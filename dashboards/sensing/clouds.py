"""Points of foxglove.PointCloud messages and of Spot's depth pictures, on the map.

Every length that a message claims is first compared with its bytes; what does not match gives no points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dashboards.sensing.frames import Frames, matrix, spot_pose
from workbench.arrays import Floats, Floats32

MAX_POINTS = 60_000
"""The most points of one message; a larger one is subsampled evenly."""
NUMBERS = {1: "u1", 2: "i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4", 7: "<f4", 8: "<f8"}
"""foxglove.PackedElementField.NumericType as numpy types."""
DEPTH_U16, RAW = 5, 2
"""bosdyn.api.Image: PIXEL_FORMAT_DEPTH_U16 and FORMAT_RAW."""
NO_DEPTH = (0, 65535)
"""Pixels of a depth picture without a depth: nothing measured, or beyond the camera's range."""
NOTHING: Floats32 = np.zeros((0, 3), dtype=np.float32)


@dataclass(frozen=True, slots=True, kw_only=True)
class PinholeLens:
    """A pinhole lens in pixels: focal lengths, and the index of the pixel on the optical axis."""

    fx: float
    fy: float
    cx: float
    cy: float


def cloud_points(message: Any, frames: Frames, stamp_ns: int) -> Floats32:
    """The points of a foxglove.PointCloud on the map; none when it cannot be read or placed."""
    columns = [column for name in ("x", "y", "z") if (column := _column(message, name)) is not None]
    map_from_frame = frames.on_map(message.frame_id, stamp_ns)
    frame_from_cloud = (
        matrix(message.pose.position, message.pose.orientation) if message.HasField("pose") else np.eye(4)
    )
    if len(columns) < 3 or map_from_frame is None or frame_from_cloud is None:
        return NOTHING
    return placed(np.column_stack(columns), map_from_frame @ frame_from_cloud)


def depth_points(response: Any, frames: Frames, stamp_ns: int) -> Floats32:
    """The points of a Spot's depth picture (bosdyn.api.ImageResponse) on the map; none for another picture."""
    image, lens = response.shot.image, scaled_lens(response.source, response.shot.image)
    cells = image.rows * image.cols
    if image.pixel_format != DEPTH_U16 or image.format != RAW or not cells or len(image.data) != 2 * cells:
        return NOTHING
    if lens is None:
        return NOTHING
    sensor = spot_pose(response.shot.transforms_snapshot, response.shot.frame_name_image_sensor, "odom")
    map_from_odom = frames.on_map("odom", stamp_ns)
    if sensor is None or map_from_odom is None:
        return NOTHING
    values = np.frombuffer(image.data, dtype="<u2")
    depth = values.astype(np.float64) / (response.source.depth_scale or 1000.0)
    row, column = np.divmod(np.arange(cells), image.cols)
    x = (column - lens.cx) / lens.fx * depth
    y = (row - lens.cy) / lens.fy * depth
    return placed(np.column_stack([x, y, depth])[~np.isin(values, NO_DEPTH)], map_from_odom @ sensor)


def scaled_lens(source: Any, image: Any) -> PinholeLens | None:
    """The pinhole lens of a Spot's camera in the pixels of a picture; None without one.

    The SDK counts pixels by their index: the ray through pixel (column, row) is ((column - cx) / fx,
    (row - cy) / fy). A resized picture keeps the centre of its first pixel half a pixel from its edge.

    Args:
        source: bosdyn.api.ImageSource, with the lens at full size.
        image: bosdyn.api.Image, resized or not.
    """
    lens = source.pinhole.intrinsics
    if not (lens.focal_length.x > 0 and lens.focal_length.y > 0):
        return None
    wide = image.cols / source.cols if source.cols else 1.0
    high = image.rows / source.rows if source.rows else 1.0
    return PinholeLens(
        fx=lens.focal_length.x * wide,
        fy=lens.focal_length.y * high,
        cx=(lens.principal_point.x + 0.5) * wide - 0.5,
        cy=(lens.principal_point.y + 0.5) * high - 0.5,
    )


def placed(points: Floats, pose: Floats) -> Floats32:
    """Points moved by a pose, without non-finite ones, subsampled evenly to MAX_POINTS."""
    points = points[:: max(1, -(-len(points) // MAX_POINTS))]
    points = points[np.isfinite(points).all(axis=1)]
    return (points @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32)


def _column(message: Any, name: str) -> Floats | None:
    stride = message.point_stride
    field = next((f for f in message.fields if f.name == name), None)
    kind = np.dtype(NUMBERS[field.type]) if field is not None and field.type in NUMBERS else None
    if field is None or kind is None or stride <= 0 or field.offset + kind.itemsize > stride:
        return None
    count = len(message.data) // stride
    table = np.frombuffer(message.data, dtype=np.uint8, count=count * stride).reshape(count, stride)
    packed = np.ascontiguousarray(table[:, field.offset : field.offset + kind.itemsize])
    return packed.view(kind).ravel().astype(np.float64)
