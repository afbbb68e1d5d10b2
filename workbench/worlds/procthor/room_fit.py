"""Clipping of usual object sizes so that the object stays inside its room.

Positions are exact even where sizes are only usual ones, so an object with its back to a wall must not extend
beyond the wall.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin

from workbench.worlds.geometry import Point, Pose
from workbench.worlds.maps.connectivity import inside

MIN_SIZE_M = 0.1
"""Smallest size in metres after clipping."""


def clip_to_room(
    size_m: tuple[float, float, float], pose: Pose, floor: Sequence[Point]
) -> tuple[float, float, float]:
    """(depth, width, height) with depth and width clipped to the floor around the centre.

    Unchanged if the object is not rotated by a multiple of 90 degrees, or its centre is not on the floor.
    """
    quarter = pose.yaw_rad / (pi / 2)
    if abs(quarter - round(quarter)) > 0.01 or not inside(pose.point, floor):
        return size_m
    depth, width, height = size_m
    ahead = (round(cos(pose.yaw_rad)), round(sin(pose.yaw_rad)))
    aside = (-ahead[1], ahead[0])
    return (_cut(depth, pose.point, ahead, floor), _cut(width, pose.point, aside, floor), height)


def _cut(extent: float, middle: Point, along: tuple[int, int], floor: Sequence[Point]) -> float:
    room = min(_to_edge(middle, along, floor), _to_edge(middle, (-along[0], -along[1]), floor))
    return min(extent, max(MIN_SIZE_M, 2 * room))


def _to_edge(point: Point, along: tuple[int, int], floor: Sequence[Point]) -> float:
    """Distance in metres from a point inside a polygon to its boundary in one of the four axis directions."""
    axis, other = (0, 1) if along[0] else (1, 0)
    sign = along[axis]
    nearest = float("inf")
    for a, b in zip(floor, (*floor[1:], floor[0]), strict=True):
        low, high = sorted((a[other], b[other]))
        if low <= point[other] <= high and low < high:
            at = a[axis] + (b[axis] - a[axis]) * (point[other] - a[other]) / (b[other] - a[other])
            if (at - point[axis]) * sign >= 0:
                nearest = min(nearest, (at - point[axis]) * sign)
    return nearest
