"""The test whether a wall is between two points of a floor, by the geometry of the walls.

LinesOfSight answers from a grid, for all points of a floor at once, and takes what is outside the rooms for a wall.
"""

from __future__ import annotations

from math import hypot

from workbench.tolerances import DEGENERATE
from workbench.worlds.geometry import Point
from workbench.worlds.house import FloorPlan


def clear_line(plan: FloorPlan, a: Point, b: Point) -> bool:
    """Whether the line between two points crosses no wall; doors are open."""
    for wall in plan.walls:
        if wall.empty:
            continue
        hit = _crossing(a, b, wall.start, wall.end)
        if hit is not None and not any(_on(hit, door.start, door.end) for door in plan.doors if door.passable):
            return False
    return True


def _crossing(a: Point, b: Point, c: Point, d: Point) -> Point | None:
    """The point at which the segments ab and cd cross, or None."""
    rx, ry, sx, sy = b[0] - a[0], b[1] - a[1], d[0] - c[0], d[1] - c[1]
    cross = rx * sy - ry * sx
    if abs(cross) < DEGENERATE:
        return None
    t = ((c[0] - a[0]) * sy - (c[1] - a[1]) * sx) / cross
    u = ((c[0] - a[0]) * ry - (c[1] - a[1]) * rx) / cross
    return (a[0] + t * rx, a[1] + t * ry) if 0 <= t <= 1 and 0 <= u <= 1 else None


def _on(point: Point, a: Point, b: Point) -> bool:
    along = hypot(b[0] - a[0], b[1] - a[1])
    return hypot(point[0] - a[0], point[1] - a[1]) + hypot(point[0] - b[0], point[1] - b[1]) <= along + 0.02
