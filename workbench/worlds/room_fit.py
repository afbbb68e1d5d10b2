"""How large can a thing be, given where its middle is? A usual size is cut so that it stays inside its room.

Positions are exact even where sizes are only usual: what stands with its back to a wall reaches as far as the wall.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin

from workbench.worlds.connectivity import inside
from workbench.worlds.geometry import Point, Pose

LEAST_M = 0.1
"""Nothing is made smaller than this."""


def fitted(size_m: tuple[float, float, float], pose: Pose, floor: Sequence[Point]) -> tuple[float, float, float]:
    """(depth, width, height) with depth and width cut to what fits on the floor around the middle.

    Unchanged for a thing that is turned by other than a quarter turn, or whose middle is not on the floor.
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
    return min(extent, max(LEAST_M, 2 * room))


def _to_edge(point: Point, along: tuple[int, int], floor: Sequence[Point]) -> float:
    """Metres from a point inside a polygon to its edge in one of the four directions of the axes."""
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
