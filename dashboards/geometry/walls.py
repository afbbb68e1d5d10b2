"""Walls as boxes with their doors and windows cut out, up to the height of the view's cut.

A wall may be listed twice, once from each room: it is drawn once. An opening belongs to every wall that it lies in,
whichever room names it, so that openings are matched by position and not by name.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot

from dashboards.geometry.solids import Solid
from dashboards.palette import DOOR_FRAME, DOOR_SHUT, GLASS, WALL, WALL_CAP
from workbench.worlds.geometry import Point
from workbench.worlds.house import FloorPlan, Opening, Wall

THICKNESS_M = 0.09
CAP_M = 0.03
CUT_AWAY_M = 0.75
"""Height of walls in the cut-away view: low enough to look over, high enough to recognise as a wall."""
REACH_M = 0.25
"""An opening this close to a wall's line lies in it."""
SHORTEST_M = 0.02


@dataclass(frozen=True, slots=True)
class Gap:
    """An opening in one wall, in metres along it and in height."""

    start_m: float
    end_m: float
    bottom_m: float
    top_m: float
    opening: Opening
    is_door: bool


@dataclass(frozen=True, slots=True)
class _WallLine:
    """A wall's line: its start, unit direction, length and height."""

    start: Point
    along: Point
    length_m: float
    height_m: float

    @property
    def yaw_rad(self) -> float:
        return atan2(self.along[1], self.along[0])

    def at(self, s_m: float, z_m: float) -> tuple[float, float, float]:
        return (self.start[0] + self.along[0] * s_m, self.start[1] + self.along[1] * s_m, z_m)


def wall_solids(plan: FloorPlan, *, cut_m: float | None = CUT_AWAY_M) -> tuple[Solid, ...]:
    """Walls of a floor plan as boxes, with doors and windows cut out.

    Args:
        plan: the floor plan.
        cut_m: walls end at this height with a dark cap; None shows them whole.
    """
    solids: list[Solid] = []
    for wall in _distinct(plan.walls):
        line = _line(wall)
        top = line.height_m if cut_m is None else min(cut_m, line.height_m)
        gaps = gaps_of(wall, plan)
        solids += _pieces(line, gaps, top, cap=cut_m is not None)
        for gap in gaps:
            solids += _filling(line, gap, top)
    return tuple(solids)


def gaps_of(wall: Wall, plan: FloorPlan) -> tuple[Gap, ...]:
    """The doors and windows that lie in a wall, in order along it."""
    line = _line(wall)
    found: list[Gap] = []
    openings = [(o, True) for o in plan.doors] + [(o, False) for o in plan.windows]
    for opening, is_door in openings:
        span = _span(line, opening)
        if span is not None:
            found.append(Gap(*span, opening.bottom_m, opening.top_m, opening, is_door))
    return tuple(sorted(found, key=lambda gap: (gap.start_m, gap.end_m, gap.opening.id)))


def _distinct(walls: tuple[Wall, ...]) -> tuple[Wall, ...]:
    """Each standing wall once, whichever of its two sides is listed first."""
    seen: dict[tuple[Point, ...], Wall] = {}
    for wall in walls:
        if wall.empty or hypot(wall.end[0] - wall.start[0], wall.end[1] - wall.start[1]) < SHORTEST_M:
            continue
        ends = sorted((round(p[0], 2), round(p[1], 2)) for p in (wall.start, wall.end))
        seen.setdefault(tuple(ends), wall)
    return tuple(seen.values())


def _line(wall: Wall) -> _WallLine:
    dx, dy = wall.end[0] - wall.start[0], wall.end[1] - wall.start[1]
    length = max(hypot(dx, dy), SHORTEST_M)
    return _WallLine(wall.start, (dx / length, dy / length), length, wall.height_m)


def _span(line: _WallLine, opening: Opening) -> tuple[float, float] | None:
    """Where along a wall an opening lies, or None when it lies in another wall."""
    ends: list[float] = []
    for x, y in (opening.start, opening.end):
        rx, ry = x - line.start[0], y - line.start[1]
        if abs(rx * line.along[1] - ry * line.along[0]) > REACH_M:
            return None
        ends.append(rx * line.along[0] + ry * line.along[1])
    start, end = max(0.0, min(ends)), min(line.length_m, max(ends))
    return (start, end) if end - start > SHORTEST_M else None


def _pieces(line: _WallLine, gaps: tuple[Gap, ...], top_m: float, *, cap: bool) -> list[Solid]:
    """The wall itself: whole pieces between openings, and what is below and above each opening."""
    solids: list[Solid] = []
    at = -THICKNESS_M / 2
    for gap in gaps:
        if gap.start_m > at:
            solids += _stretch(line, at, gap.start_m, 0.0, top_m, cap=cap)
        start = max(at, gap.start_m)
        if gap.end_m > start:
            solids += _stretch(
                line, start, gap.end_m, 0.0, min(gap.bottom_m, top_m), cap=cap and gap.bottom_m >= top_m
            )
            solids += _stretch(line, start, gap.end_m, gap.top_m, top_m, cap=cap)
        at = max(at, gap.end_m)
    solids += _stretch(line, at, line.length_m + THICKNESS_M / 2, 0.0, top_m, cap=cap)
    return solids


def _stretch(line: _WallLine, start_m: float, end_m: float, low_m: float, high_m: float, *, cap: bool) -> list[Solid]:
    if end_m - start_m < SHORTEST_M or high_m - low_m < SHORTEST_M:
        return []
    middle, length = (start_m + end_m) / 2, end_m - start_m
    body_top = high_m - CAP_M if cap else high_m
    made = [_bar(line, middle, length, low_m, body_top, WALL, THICKNESS_M)]
    if cap:
        made.append(_bar(line, middle, length, body_top, high_m, WALL_CAP, THICKNESS_M))
    return made


def _filling(line: _WallLine, gap: Gap, top_m: float) -> list[Solid]:
    """What is in an opening: a threshold and posts for a door, glass for a window, a leaf for a closed door."""
    middle, width = (gap.start_m + gap.end_m) / 2, gap.end_m - gap.start_m
    high = min(gap.top_m, top_m)
    if not gap.is_door:
        if high - gap.bottom_m < SHORTEST_M:
            return []
        return [_bar(line, middle, width, gap.bottom_m, high, GLASS, 0.03)]
    if not gap.opening.passable:
        return [_bar(line, middle, width, 0.0, high, DOOR_SHUT, 0.05)]
    posts = [
        _bar(line, s, 0.05, 0.0, high + (CAP_M / 3 if high >= top_m else 0.0), DOOR_FRAME, THICKNESS_M + 0.03)
        for s in (gap.start_m + 0.025, gap.end_m - 0.025)
    ]
    return [_bar(line, middle, width, 0.0, 0.012, DOOR_FRAME, THICKNESS_M + 0.03), *posts]


def _bar(
    line: _WallLine,
    middle_m: float,
    length_m: float,
    low_m: float,
    high_m: float,
    colour: tuple[int, int, int],
    depth_m: float,
) -> Solid:
    return Solid(
        "box",
        line.at(middle_m, (low_m + high_m) / 2),
        (length_m, depth_m, max(high_m - low_m, 0.001)),
        line.yaw_rad,
        colour,
    )
