"""Walls as boxes, with what is in their doors and windows, up to the height of the view's cut."""

from __future__ import annotations

from dashboards.geometry.solids import Solid
from dashboards.palette import DOOR_FRAME, DOOR_SHUT, GLASS, WALL, WALL_CAP
from workbench.worlds.house import FloorPlan
from workbench.worlds.walls import (
    MIN_WALL_M,
    THICKNESS_M,
    WallGap,
    WallLine,
    WallPiece,
    gaps_of,
    line_of,
    pieces_of,
    standing_walls,
)

CAP_M = 0.03
CUT_AWAY_M = 0.75
"""Height of walls in the cut-away view: low enough to look over, high enough to recognise as a wall."""


def wall_solids(plan: FloorPlan, *, cut_m: float | None = CUT_AWAY_M) -> tuple[Solid, ...]:
    """Walls of a floor plan as boxes, with doors and windows cut out.

    Args:
        plan: the floor plan.
        cut_m: walls end at this height with a dark cap; None shows them whole.
    """
    solids: list[Solid] = []
    for wall in standing_walls(plan):
        line = line_of(wall)
        top = line.height_m if cut_m is None else min(cut_m, line.height_m)
        gaps = gaps_of(wall, plan)
        for piece in pieces_of(line, gaps, top_m=top):
            solids += _piece(line, piece, cap=cut_m is not None and piece.high_m >= top)
        for gap in gaps:
            solids += _filling(line, gap, top)
    return tuple(solids)


def _piece(line: WallLine, piece: WallPiece, *, cap: bool) -> list[Solid]:
    middle, length = (piece.start_m + piece.end_m) / 2, piece.end_m - piece.start_m
    body_top = piece.high_m - CAP_M if cap else piece.high_m
    made = [_bar(line, middle, length, piece.low_m, body_top, WALL, THICKNESS_M)]
    if cap:
        made.append(_bar(line, middle, length, body_top, piece.high_m, WALL_CAP, THICKNESS_M))
    return made


def _filling(line: WallLine, gap: WallGap, top_m: float) -> list[Solid]:
    """What is in an opening: a threshold and posts for a door, glass for a window, a leaf for a closed door."""
    middle, width = (gap.start_m + gap.end_m) / 2, gap.end_m - gap.start_m
    high = min(gap.top_m, top_m)
    if not gap.is_door:
        if high - gap.bottom_m < MIN_WALL_M:
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
    line: WallLine,
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
