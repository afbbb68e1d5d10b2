"""Walls with their doors and windows cut out, as every view draws them.

A wall may be listed twice, once from each room: it is drawn once. An opening belongs to every wall that it is in,
whichever room names it, so that openings are matched by position and not by name; the two rooms' lines of one wall
may be a thick wall apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot

from workbench.worlds.geometry import Point
from workbench.worlds.house import FloorPlan, Opening, Wall

THICKNESS_M = 0.09
REACH_M = 0.25
"""An opening this close to a wall's line is in it."""
MIN_WALL_M = 0.02
"""Pieces and openings below this are left out."""


@dataclass(frozen=True, slots=True)
class WallGap:
    """An opening in one wall, in metres along it and in height."""

    start_m: float
    end_m: float
    bottom_m: float
    top_m: float
    opening: Opening
    is_door: bool


@dataclass(frozen=True, slots=True)
class WallPiece:
    """A box of a wall, in metres along it and in height."""

    start_m: float
    end_m: float
    low_m: float
    high_m: float


@dataclass(frozen=True, slots=True)
class WallLine:
    """A wall's line: its start, unit direction, length and height."""

    start: Point
    along: Point
    length_m: float
    height_m: float

    @property
    def yaw_rad(self) -> float:
        return atan2(self.along[1], self.along[0])

    def at(self, s_m: float, z_m: float) -> tuple[float, float, float]:
        """The point at a distance along the line and a height."""
        return (self.start[0] + self.along[0] * s_m, self.start[1] + self.along[1] * s_m, z_m)


def standing_walls(plan: FloorPlan) -> tuple[Wall, ...]:
    """Each standing wall once, whichever of its two sides is listed first."""
    seen: dict[tuple[Point, ...], Wall] = {}
    for wall in plan.walls:
        if wall.empty or hypot(wall.end[0] - wall.start[0], wall.end[1] - wall.start[1]) < MIN_WALL_M:
            continue
        ends = sorted((round(p[0], 2), round(p[1], 2)) for p in (wall.start, wall.end))
        seen.setdefault(tuple(ends), wall)
    return tuple(seen.values())


def line_of(wall: Wall) -> WallLine:
    dx, dy = wall.end[0] - wall.start[0], wall.end[1] - wall.start[1]
    length = max(hypot(dx, dy), MIN_WALL_M)
    return WallLine(wall.start, (dx / length, dy / length), length, wall.height_m)


def gaps_of(wall: Wall, plan: FloorPlan) -> tuple[WallGap, ...]:
    """The doors and windows in a wall, in order along it."""
    line = line_of(wall)
    found: list[WallGap] = []
    openings = [(o, True) for o in plan.doors] + [(o, False) for o in plan.windows]
    for opening, is_door in openings:
        span = _span(line, opening)
        if span is not None:
            found.append(WallGap(*span, opening.bottom_m, opening.top_m, opening, is_door))
    return tuple(sorted(found, key=lambda gap: (gap.start_m, gap.end_m, gap.opening.id)))


def pieces_of(line: WallLine, gaps: Sequence[WallGap], *, top_m: float) -> tuple[WallPiece, ...]:
    """The wall itself: whole pieces between openings, and what is below and above each opening.

    Its ends reach half a thickness beyond the line, so that corners are closed.

    Args:
        top_m: where the wall ends or is cut.
    """
    pieces: list[WallPiece] = []
    at = -THICKNESS_M / 2
    for gap in gaps:
        if gap.start_m > at:
            pieces.append(WallPiece(at, gap.start_m, 0.0, top_m))
        start = max(at, gap.start_m)
        if gap.end_m > start:
            pieces.append(WallPiece(start, gap.end_m, 0.0, min(gap.bottom_m, top_m)))
            pieces.append(WallPiece(start, gap.end_m, gap.top_m, top_m))
        at = max(at, gap.end_m)
    pieces.append(WallPiece(at, line.length_m + THICKNESS_M / 2, 0.0, top_m))
    return tuple(p for p in pieces if p.end_m - p.start_m >= MIN_WALL_M and p.high_m - p.low_m >= MIN_WALL_M)


def _span(line: WallLine, opening: Opening) -> tuple[float, float] | None:
    """The span of an opening along a wall; None if it is in another wall."""
    ends: list[float] = []
    for x, y in (opening.start, opening.end):
        rx, ry = x - line.start[0], y - line.start[1]
        if abs(rx * line.along[1] - ry * line.along[0]) > REACH_M:
            return None
        ends.append(rx * line.along[0] + ry * line.along[1])
    start, end = max(0.0, min(ends)), min(line.length_m, max(ends))
    return (start, end) if end - start > MIN_WALL_M else None
