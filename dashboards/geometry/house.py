"""Geometry of a house that does not change during a run: floors, walls and furniture, ready to draw."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot

import numpy as np

from dashboards.geometry.floors import Floor, floors
from dashboards.geometry.furniture import furniture_solids, solids_of
from dashboards.geometry.solids import NO_OWNER, Batch, Solid, batches
from dashboards.geometry.walls import CUT_AWAY_M, wall_solids
from workbench.worlds.house import FloorPlan

FLOATING_M = 0.3
"""Furniture that hangs higher than this casts no shade on the floor."""
SHADE_GROWN_M = (0.14, 0.08, 0.03)
SHADE_SHIFT_M = 0.04


@dataclass(frozen=True, slots=True, kw_only=True)
class HouseShape:
    """Everything of a house that does not change during a run, except the colours of containers.

    Attributes:
        furniture: containers, owned by their index in the plan, and the rest, without an owner.
        hung: what hangs on walls above the cut, shown with whole walls only.
        shadows: flat layers of shade under what stands on the floor, to be drawn with low opacity.
        cut_walls, whole_walls: the same walls, cut to allow a view inside, and whole.
        tops_m: for each container, the point above which its mark is drawn: (x, y, z of its top).
        centre: (x, y) of the middle of the house; reach_m: its distance to the farthest corner.
    """

    floors: tuple[Floor, ...]
    furniture: tuple[Batch, ...]
    hung: tuple[Batch, ...]
    shadows: tuple[Batch, ...]
    cut_walls: tuple[Batch, ...]
    whole_walls: tuple[Batch, ...]
    tops_m: tuple[tuple[float, float, float], ...]
    centre: tuple[float, float]
    reach_m: float
    low: tuple[float, float]
    high: tuple[float, float]


def house_shape(plan: FloorPlan) -> HouseShape:
    """The shapes of a floor plan."""
    corners = np.array([p for room in plan.rooms for p in room.floor], dtype=np.float64)
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle = (low + high) / 2
    hung = tuple(piece for piece in plan.furniture if piece.base_m >= CUT_AWAY_M)
    standing = replace(plan, furniture=tuple(piece for piece in plan.furniture if piece.base_m < CUT_AWAY_M))
    return HouseShape(
        floors=floors(plan),
        furniture=batches(furniture_solids(standing)),
        hung=batches(s for piece in hung for s in solids_of(piece, owner=NO_OWNER)),
        shadows=batches(_shade(standing)),
        cut_walls=batches(wall_solids(plan, cut_m=CUT_AWAY_M)),
        whole_walls=batches(wall_solids(plan, cut_m=None)),
        tops_m=tuple((c.pose.x_m, c.pose.y_m, c.base_m + max(c.size_m[2], 0.05)) for c in plan.containers),
        centre=(float(middle[0]), float(middle[1])),
        reach_m=max(1.0, hypot(*(high - low)) / 2),
        low=(float(low[0]), float(low[1])),
        high=(float(high[0]), float(high[1])),
    )


def _shade(plan: FloorPlan) -> list[Solid]:
    """Three flat layers, each larger than the one before, under everything that stands on the floor."""
    layers: list[Solid] = []
    for body in (*plan.containers, *plan.furniture):
        if body.base_m > FLOATING_M:
            continue
        for i, grown in enumerate(SHADE_GROWN_M):
            size = (body.size_m[0] + 2 * grown, body.size_m[1] + 2 * grown, 0.001)
            at = (body.pose.x_m + SHADE_SHIFT_M, body.pose.y_m + SHADE_SHIFT_M, 0.004 + 0.003 * i)
            layers.append(Solid("box", at, size, body.pose.yaw_rad, (30, 32, 48)))
    return layers
