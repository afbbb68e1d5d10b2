"""Poses and points in the map frame (REP-103: x forward, y left, z up; metres and radians)."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, isfinite, sin

from workbench.errors import BadValue

Point = tuple[float, float]
"""A point (x, y) on the floor of the map frame, in metres."""

MAX_COORDINATE_M = 10_000.0
"""Larger coordinates are taken as a mistake of units."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """A planar pose with height in the map frame; metres and radians.

    Raises:
        BadValue: a coordinate that is not finite or beyond MAX_COORDINATE_M.
    """

    x_m: float
    y_m: float
    yaw_rad: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("x_m", self.x_m), ("y_m", self.y_m), ("yaw_rad", self.yaw_rad)):
            if not isfinite(value) or abs(value) > MAX_COORDINATE_M:
                raise BadValue(f"pose {name}", value, f"finite and within {MAX_COORDINATE_M:.0f} m")

    @property
    def point(self) -> Point:
        return (self.x_m, self.y_m)


def footprint(pose: Pose, size_x_m: float, size_y_m: float) -> tuple[Point, Point, Point, Point]:
    """The four corners of a box of size_x by size_y metres, centred on and rotated by the pose, counter-clockwise."""
    c, s = cos(pose.yaw_rad), sin(pose.yaw_rad)
    half = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    corners = [
        (
            pose.x_m + c * i * size_x_m / 2 - s * j * size_y_m / 2,
            pose.y_m + s * i * size_x_m / 2 + c * j * size_y_m / 2,
        )
        for i, j in half
    ]
    return (corners[0], corners[1], corners[2], corners[3])
