"""Triangles of a room's floor, as every view draws it.

Not shapely's triangles: they come in another order from one release of its library (GEOS) to the next, and so would
the bytes of a log.
"""

from __future__ import annotations

from collections.abc import Sequence

from workbench.worlds.geometry import Point


def triangulated(floor: Sequence[Point]) -> list[tuple[int, int, int]]:
    """Triangles of a simple polygon, by cutting ears; indices into its corners, counter-clockwise."""
    left = list(range(len(floor)))
    if _turn_sum(floor) < 0:
        left.reverse()
    triangles: list[tuple[int, int, int]] = []
    while len(left) > 3:
        ear = next((k for k in range(len(left)) if _is_ear(floor, left, k)), None)
        if ear is None:  # a self-intersecting polygon: draw the rest as a fan
            break
        triangles.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        left.pop(ear)
    return triangles + [(left[0], left[k], left[k + 1]) for k in range(1, len(left) - 1)]


def _is_ear(floor: Sequence[Point], left: list[int], k: int) -> bool:
    a, b, c = floor[left[k - 1]], floor[left[k]], floor[left[(k + 1) % len(left)]]
    if _cross(a, b, c) <= 0:
        return False
    others = (floor[i] for i in left if floor[i] not in (a, b, c))
    return not any(_cross(a, b, p) >= 0 and _cross(b, c, p) >= 0 and _cross(c, a, p) >= 0 for p in others)


def _cross(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _turn_sum(floor: Sequence[Point]) -> float:
    return sum(floor[i - 1][0] * floor[i][1] - floor[i][0] * floor[i - 1][1] for i in range(len(floor)))
