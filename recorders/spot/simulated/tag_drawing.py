"""AprilTags drawn into simulated pictures, as a pinhole camera shows them."""

from __future__ import annotations

from functools import lru_cache
from math import atan2

import numpy as np
from bosdyn.client.math_helpers import Quat, SE3Pose

from workbench.arrays import Floats, Uints8

MODULES, WHITE = 8, 1
"""Squares across the black side of a tag of 36h11, and of the white around it."""
FINE = 4
"""Rays across each pixel: a module is only a few pixels wide."""
NEAR_M = 0.1


def facing(position: tuple[float, float, float]) -> SE3Pose:
    """body_tform_tag of an upright tag at a position in the body frame that faces the body."""
    x, y = position[0], position[1]
    return SE3Pose(x=x, y=y, z=position[2], rot=Quat.from_yaw(atan2(y, x)) * _AHEAD)


def draw_tag(image: Uints8, number: int, size_m: float, camera_tform_tag: SE3Pose, focal_px: float) -> None:
    """Draw a tag into grey values, shape (rows, columns), whose principal point is their middle.

    Without OpenCV, which has the codes of the tags, it is drawn black.
    """
    rows, columns = image.shape
    tag, rotation = camera_tform_tag, camera_tform_tag.rot.to_matrix()
    at = np.array([tag.x, tag.y, tag.z])
    if at[2] < NEAR_M or rotation[:, 2] @ at >= 0:
        return
    middle = np.array([(columns - 1) / 2, (rows - 1) / 2])
    half = size_m / 2 * (MODULES + 2 * WHITE) / MODULES
    corners = np.array([(-half, -half), (-half, half), (half, half), (half, -half)])
    seen = at + corners @ rotation[:, :2].T
    if seen[:, 2].min() < NEAR_M:
        return
    pixels = seen[:, :2] / seen[:, 2:] * focal_px + middle
    low, high = np.floor(pixels.min(axis=0)).astype(int), np.ceil(pixels.max(axis=0)).astype(int) + 1
    (left, top), (right, bottom) = np.maximum(low, 0), np.minimum(high, [columns, rows])
    if left >= right or top >= bottom:
        return
    plane = np.linalg.inv(np.column_stack([rotation[:, 0], rotation[:, 1], at]))
    u, v = _fine(left, right), _fine(top, bottom)
    rays = np.stack(
        [
            np.broadcast_to((u[None, :] - middle[0]) / focal_px, (len(v), len(u))),
            np.broadcast_to((v[:, None] - middle[1]) / focal_px, (len(v), len(u))),
            np.ones((len(v), len(u))),
        ]
    )
    along, up, scale = np.tensordot(plane, rays, axes=1)
    module = size_m / MODULES
    column = np.floor((along / scale + half) / module).astype(int)
    row = np.floor((half - up / scale) / module).astype(int)
    bits = _bits(number)
    inside = (row >= 0) & (row < len(bits)) & (column >= 0) & (column < len(bits))
    under = np.repeat(np.repeat(image[top:bottom, left:right], FINE, axis=0), FINE, axis=1)
    fine = np.where(inside, bits[row * inside, column * inside], under).astype(np.float64)
    image[top:bottom, left:right] = fine.reshape(bottom - top, FINE, right - left, FINE).mean(axis=(1, 3)).round()


def _fine(first: int, end: int) -> Floats:
    """The positions of rays over the pixels from first to end, whose centres are at whole numbers."""
    return first - 0.5 + (np.arange((end - first) * FINE) + 0.5) / FINE


@lru_cache(maxsize=256)
def _bits(number: int) -> Uints8:
    """The squares of a tag of 36h11 that stands upright, with the white around it."""
    framed = np.full((MODULES + 2 * WHITE, MODULES + 2 * WHITE), 255, dtype=np.uint8)
    framed[WHITE:-WHITE, WHITE:-WHITE] = 0
    try:
        import cv2
    except ImportError:
        return framed
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    if 0 <= number < len(family.bytesList):  # OpenCV has them upside down
        framed[WHITE:-WHITE, WHITE:-WHITE] = np.rot90(cv2.aruco.generateImageMarker(family, number, MODULES), 2)
    return framed


_AHEAD = Quat.from_matrix(np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
"""The turn of a tag straight ahead: its x to the right, which is -y of the body, its y up, its z towards the body."""
