"""How does Unity's frame become the map frame? In this one place.

Unity (y up, left-handed, metres, degrees) becomes the map frame (z up, right-handed, REP-103): map x is Unity x, map
y is Unity z, heights are Unity y. A thing that is not turned in Unity faces Unity z, that is map y, and Unity turns
clockwise seen from above: yaw is pi/2 minus the angle. So x of a thing's own frame is its front, and its size is
(depth, width, height).
"""

from __future__ import annotations

from math import isfinite, pi, radians

from workbench.errors import BadValue
from workbench.worlds.geometry import MAX_COORDINATE_M, Point, Pose
from workbench.worlds.procthor_json import Vector


def pose_from_unity(position: Vector, rotation: Vector) -> Pose:
    """Where a thing of Unity's frame stands and faces in the map frame. Raises BadValue when not finite."""
    turned = rotation.y % 360 if isfinite(rotation.y) else rotation.y
    return Pose(x_m=position.x, y_m=position.z, yaw_rad=pi / 2 - radians(turned))


def point_from_unity(corner: Vector, where: str) -> Point:
    """A point on the floor of the map. Raises BadValue, naming where, when not finite or too far."""
    for value in (corner.x, corner.y, corner.z):
        if not isfinite(value) or abs(value) > MAX_COORDINATE_M:
            raise BadValue(where, value, f"finite and within {MAX_COORDINATE_M:.0f} m")
    return (corner.x, corner.z)
