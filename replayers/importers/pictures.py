"""Turns ROS images and maps into Foxglove's: JPEG and PNG pass unchanged, raw images are encoded as JPEG."""

from __future__ import annotations

import io
from math import atan2
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from recorders.foxglove.scene import timestamp
from replayers.importers.frames import matrix_of
from workbench.worlds.maps.occupancy import OccupancyGrid
from workbench.worlds.maps.rotated_grid import is_occupied

MODES = {"mono8": 1, "8UC1": 1, "rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}
"""Encodings of raw images that can be compressed, with their bytes per pixel."""
QUALITY = 80
MAX_PIXELS = 40_000_000


def compressed(message: Any, stamp_ns: int) -> CompressedImage | None:
    """A sensor_msgs/CompressedImage unchanged; None if it is not JPEG or PNG (a compressed depth image)."""
    data = bytes(np.asarray(message.data, dtype=np.uint8))
    kind = "jpeg" if data[:2] == b"\xff\xd8" else "png" if data[:4] == b"\x89PNG" else None
    if kind is None:
        return None
    return CompressedImage(
        timestamp=timestamp(stamp_ns), frame_id=message.header.frame_id.lstrip("/"), data=data, format=kind
    )


def packed(message: Any, stamp_ns: int) -> CompressedImage | None:
    """A sensor_msgs/Image as JPEG; None for encodings that are not pictures (depth) or sizes that do not match."""
    from PIL import Image

    depth = MODES.get(message.encoding)
    rows, columns, step = int(message.height), int(message.width), int(message.step)
    data = np.asarray(message.data, dtype=np.uint8)
    if depth is None or not 0 < rows * columns <= MAX_PIXELS or step < columns * depth or data.size < rows * step:
        return None
    pixels = data[: rows * step].reshape(rows, step)[:, : columns * depth].reshape(rows, columns, depth)
    if message.encoding.startswith("bgr"):
        pixels = pixels[:, :, [2, 1, 0, *range(3, depth)]]
    picture = Image.fromarray(pixels[:, :, 0] if depth == 1 else np.ascontiguousarray(pixels[:, :, :3]))
    stream = io.BytesIO()
    picture.save(stream, "JPEG", quality=QUALITY)
    return CompressedImage(
        timestamp=timestamp(stamp_ns),
        frame_id=message.header.frame_id.lstrip("/"),
        data=stream.getvalue(),
        format="jpeg",
    )


def calibration(message: Any, stamp_ns: int) -> CameraCalibration:
    """A sensor_msgs/CameraInfo; its matrices are K in ROS 1 and k in ROS 2."""

    def numbers(name: str) -> list[float]:
        values = getattr(message, name, getattr(message, name.lower(), ()))
        return [float(value) for value in values]

    return CameraCalibration(
        timestamp=timestamp(stamp_ns),
        frame_id=message.header.frame_id.lstrip("/"),
        width=int(message.width),
        height=int(message.height),
        distortion_model=str(message.distortion_model),
        D=numbers("D"),
        K=numbers("K"),
        R=numbers("R"),
        P=numbers("P"),
    )


def occupancy(message: Any) -> OccupancyGrid | None:
    """A nav_msgs/OccupancyGrid in the frame of its own rows; unknown cells count as occupied.

    None when its sizes do not match.
    """
    info = message.info
    cells = np.asarray(message.data, dtype=np.int8)
    if info.width * info.height != cells.size or cells.size == 0 or not info.resolution > 0:
        return None
    values = cells.reshape(info.height, info.width)
    return OccupancyGrid(
        origin=(float(info.origin.position.x), float(info.origin.position.y)),
        resolution_m=float(info.resolution),
        occupied=is_occupied(values),
    )


def turn_of(message: Any) -> float:
    """The yaw of a nav_msgs/OccupancyGrid's rows on the map, in radians; a zero quaternion counts as none."""
    matrix = matrix_of(message.info.origin.position, message.info.origin.orientation)
    return atan2(float(matrix[1, 0]), float(matrix[0, 0]))
