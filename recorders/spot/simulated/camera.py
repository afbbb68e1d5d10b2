"""Simulated cameras: plain images of walls and furniture by ray casting on the map, with the tags in view.

They provide camera channels whose images change as the robot walks; they are not realistic.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from bosdyn.api import geometry_pb2
from bosdyn.client.math_helpers import SE3Pose
from PIL import Image

from recorders.spot.simulated.frames import optical
from recorders.spot.simulated.tag_drawing import draw_tag
from workbench.arrays import Floats, Uints8, Uints16
from workbench.tolerances import MIN_SLOPE
from workbench.worlds.geometry import Pose
from workbench.worlds.maps.occupancy import OccupancyGrid

CAMERAS = {
    "frontleft_fisheye_image": 0.45,
    "frontright_fisheye_image": -0.45,
    "left_fisheye_image": pi / 2,
    "right_fisheye_image": -pi / 2,
    "back_fisheye_image": pi,
    "hand_color_image": 0.0,
}
"""Heading of each visual source in the body frame."""

FRONT_AT, HAND_AT = (0.3, 0.0, 0.0), (0.4, 0.0, 0.25)
"""Where cameras sit in the body frame, in metres."""
COLUMNS, ROWS = 640, 480
FIELD_RAD = 1.6
RAYS, DEPTH_ROWS = 160, 60
REACH_M, RAY_STEP_M = 8.0, 0.06
EYE_M, WALL_M = 0.5, 2.4


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnTag:
    """A tag in view of a camera."""

    number: int
    size_m: float
    camera_tform_tag: SE3Pose


def camera_frame(name: str) -> str:
    """The frame of an image source."""
    return name.removesuffix("_image")


def camera_mount(name: str) -> geometry_pb2.SE3Pose:
    """body_tform_camera of an image source; the hand is that of a stowed arm, above the body."""
    return optical(*(HAND_AT if name.startswith("hand") else FRONT_AT), CAMERAS[name])


def draw(
    grid: OccupancyGrid | None,
    pose: Pose,
    heading_rad: float,
    tags: Sequence[DrawnTag],
    *,
    colour: bool,
) -> Uints8:
    """An image, uint8, shape (ROWS, COLUMNS) or (ROWS, COLUMNS, 3).

    Args:
        tags: the tags in view.
    """
    depths = _depths(grid, pose, heading_rad)
    focal = COLUMNS / 2 / np.tan(FIELD_RAD / 2)
    half = np.clip(focal * (WALL_M - EYE_M) / depths, 2, ROWS)
    low = np.clip(focal * EYE_M / depths, 2, ROWS)
    row = np.arange(ROWS)[:, None] - ROWS / 2
    shade = np.clip(230 - 22 * depths, 40, 230)
    floor = np.clip(60 + row * 0.25, 30, 130)
    picture = np.where(row < -half[None, :], 200.0, np.where(row < low[None, :], shade[None, :], floor))
    image = np.repeat(picture, COLUMNS // RAYS, axis=1).astype(np.uint8)
    for tag in sorted(tags, key=_depth_of, reverse=True):
        draw_tag(image, tag.number, tag.size_m, tag.camera_tform_tag, float(focal))
    return np.repeat(image[:, :, None], 3, axis=2) if colour else image


def _depth_of(tag: DrawnTag) -> float:
    return float(tag.camera_tform_tag.z)


def jpeg(picture: Uints8, *, quality: int, ratio: float) -> tuple[bytes, int, int]:
    """An image as JPEG, scaled by `ratio`: (bytes, columns, rows)."""
    image = Image.fromarray(picture)
    if 0 < ratio < 1:
        image = image.resize((max(8, round(COLUMNS * ratio)), max(6, round(ROWS * ratio))))
    stream = io.BytesIO()
    image.save(stream, "JPEG", quality=quality)
    return stream.getvalue(), image.width, image.height


def depth_picture(grid: OccupancyGrid | None, pose: Pose, heading_rad: float) -> Uints16:
    """A depth image in millimetres along the camera axis, shape (DEPTH_ROWS, RAYS); 0 out of range."""
    focal = RAYS / 2 / np.tan(FIELD_RAD / 2)
    across = (np.arange(RAYS) + 0.5 - RAYS / 2) / focal
    down = (np.arange(DEPTH_ROWS) + 0.5 - DEPTH_ROWS / 2) / focal
    walls = _depths(grid, pose, heading_rad, across)
    level = np.where(down > 0, EYE_M, WALL_M - EYE_M) / np.maximum(np.abs(down), MIN_SLOPE)
    depths = np.minimum(walls[None, :], level[:, None])
    reached = depths * np.hypot(1.0, across) < REACH_M - RAY_STEP_M
    return np.where(reached, depths * 1000, 0).astype(np.uint16)


def _depths(grid: OccupancyGrid | None, pose: Pose, heading_rad: float, across: Floats | None = None) -> Floats:
    """Depth of the first occupied cell along the camera axis, per ray from left to right, shape (RAYS,).

    Args:
        across: tangents of the rays' angles to the axis, positive to the right; evenly spaced angles by default.
    """
    if grid is None:
        return np.full(RAYS, REACH_M)
    aside = np.linspace(FIELD_RAD / 2, -FIELD_RAD / 2, RAYS) if across is None else -np.arctan(across)
    angles = pose.yaw_rad + heading_rad + aside
    far = np.arange(0.3, REACH_M, RAY_STEP_M)
    columns = ((pose.x_m + far[:, None] * np.cos(angles) - grid.origin[0]) / grid.resolution_m).astype(np.int64)
    rows = ((pose.y_m + far[:, None] * np.sin(angles) - grid.origin[1]) / grid.resolution_m).astype(np.int64)
    inside = (rows >= 0) & (columns >= 0) & (rows < grid.occupied.shape[0]) & (columns < grid.occupied.shape[1])
    hit = ~inside | grid.occupied[rows * inside, columns * inside]
    first = np.where(hit.any(axis=0), hit.argmax(axis=0), len(far) - 1)
    return far[first] * np.cos(angles - pose.yaw_rad - heading_rad)
