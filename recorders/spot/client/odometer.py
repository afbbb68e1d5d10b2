"""The path and distance that a robot has walked: positions thinned to corner points."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot

from workbench.worlds.geometry import Point

STILL_M = 0.02
"""Smaller displacements in metres are noise of a standing robot."""
CORNER_M = 0.05
"""Largest deviation in metres of the thinned path."""


@dataclass(slots=True)
class WalkLog:
    """Positions on the map in metres."""

    points: list[Point] = field(default_factory=list)
    metres: float = 0.0

    def add(self, point: Point) -> None:
        if self.points:
            step = hypot(point[0] - self.points[-1][0], point[1] - self.points[-1][1])
            if step < STILL_M:
                return
            self.metres += step
        self.points.append(point)

    def corners(self) -> tuple[Point, ...]:
        """The path simplified by the Douglas-Peucker algorithm."""
        if len(self.points) < 3:
            return tuple(self.points)
        from shapely import LineString

        line = LineString(self.points).simplify(CORNER_M)
        return tuple((float(x), float(y)) for x, y in line.coords)
