"""The conversion from Unity's frame to the map frame; the only place that does it.

Unity (y up, left-handed, metres, degrees) becomes the map frame (z up, right-handed, REP-103): map x is Unity x,
map y is Unity z, heights are Unity y. An unrotated object faces Unity z, that is map y, and Unity rotates clockwise
seen from above, so yaw is pi/2 minus the angle. The x axis of an object's own frame is its front, and its size is
(depth, width, height).
"""

from __future__ import annotations

from math import isfinite, pi, radians

from workbench.errors import BadValue
from workbench.worlds.geometry import MAX_COORDINATE_M, Point, Pose
from workbench.worlds.procthor.schema import Vector


def pose_from_unity(position: Vector, rotation: Vector) -> Pose:
    """The pose in the map frame of an object in Unity's frame.

    Raises:
        BadValue: a value is not finite.
    """
    turned = rotation.y % 360 if isfinite(rotation.y) else rotation.y
    return Pose(x_m=position.x, y_m=position.z, yaw_rad=pi / 2 - radians(turned))


def point_from_unity(corner: Vector, where: str) -> Point:
    """A point on the floor of the map frame.

    Raises:
        BadValue: it is not finite or too far away; the message names `where`.
    """
    for value in (corner.x, corner.y, corner.z):
        if not isfinite(value) or abs(value) > MAX_COORDINATE_M:
            raise BadValue(where, value, f"finite and within {MAX_COORDINATE_M:.0f} m")
    return (corner.x, corner.z)
