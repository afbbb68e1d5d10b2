"""Floors: each room's polygon as a mesh in the colour of its kind, with the place of its label."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import hypot

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from dashboards.palette import Colour, floor_colour
from workbench.arrays import Floats, Floats32, Uints32
from workbench.tolerances import MIN_AREA_M2
from workbench.worlds.floor_triangles import triangulated
from workbench.worlds.geometry import Point
from workbench.worlds.house import FloorPlan, Room


@dataclass(frozen=True, slots=True, kw_only=True)
class Floor:
    """A room's floor: vertices float32 (V, 3) at height 0, faces uint32 (F, 3) seen from above, and its label.

    Attributes:
        label_spots: points for the label, the best first; all within the polygon.
    """

    room: str
    kind: str
    vertices: Floats32
    faces: Uints32
    colour: Colour
    label_spots: tuple[Point, ...]
    polygon: BaseGeometry = field(repr=False, compare=False)

    @property
    def label_at(self) -> Point:
        """The best spot."""
        return self.label_spots[0]


CLEAR_M = 1.5
"""A label this far from every container is clear of them, in metres."""
APART_M, MAX_SPOTS = 0.45, 40
"""Between spots of one room's label, and how many there are."""
TRIED = 9
"""Candidate positions of a room's label along each side."""


def floors(plan: FloorPlan) -> tuple[Floor, ...]:
    """The floors of all rooms whose polygon encloses an area, in the plan's order."""
    taken = np.array([container.pose.point for container in plan.containers], dtype=np.float64).reshape(-1, 2)
    return tuple(floor for room in plan.rooms if (floor := _floor(room, taken)) is not None)


def _floor(room: Room, taken: Floats) -> Floor | None:
    drawn = shapely.Polygon(room.floor)
    polygon = shapely.make_valid(drawn)
    if polygon.area < MIN_AREA_M2:
        return None
    corners = _simple(room.floor) if drawn.is_valid else _of_any(polygon)
    vertices = np.column_stack([corners, np.zeros(len(corners))]).astype(np.float32)
    return Floor(
        room=room.id,
        kind=room.kind,
        vertices=vertices,
        faces=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        colour=floor_colour(room.kind),
        label_spots=_label_spots(polygon, taken),
        polygon=polygon,
    )


def _simple(floor: Sequence[Point]) -> Floats:
    return np.array([floor[i] for triangle in triangulated(floor) for i in triangle], dtype=np.float64)


def _of_any(polygon: BaseGeometry) -> Floats:
    """The triangles of what a polygon that crosses itself encloses; it may have holes."""
    triangles = [
        np.asarray(t.exterior.coords)[:3]
        for t in shapely.constrained_delaunay_triangles(polygon).geoms
        if isinstance(t, shapely.Polygon) and t.area > 0
    ]
    return np.concatenate([_counter_clockwise(t) for t in triangles])


def _label_spots(polygon: BaseGeometry, taken: Floats) -> tuple[Point, ...]:
    """Points well inside the room and clear of containers, where belief and numbers are shown; else near its
    middle. Each is apart from those before it."""
    middle = polygon.centroid if polygon.contains(polygon.centroid) else polygon.representative_point()
    x0, y0, x1, y1 = polygon.bounds
    steps = (np.arange(TRIED) + 0.5) / TRIED
    grid = np.stack(np.meshgrid(x0 + steps * (x1 - x0), y0 + steps * (y1 - y0)), axis=-1).reshape(-1, 2)
    tried = np.concatenate([[[middle.x, middle.y]], grid[shapely.contains_xy(polygon, grid)]])
    from_wall = shapely.distance(polygon.boundary, shapely.points(tried))
    from_things = np.hypot(*(tried[:, None] - taken[None]).transpose(2, 0, 1)).min(axis=1, initial=np.inf)
    clear = np.minimum(np.minimum(from_things, 1.5 * from_wall), CLEAR_M)
    off_middle = np.hypot(*(tried - tried[0]).T)
    spots: list[Point] = []
    for i in np.argsort(-(clear - 0.15 * off_middle), kind="stable"):
        spot = (float(tried[i, 0]), float(tried[i, 1]))
        if all(hypot(spot[0] - x, spot[1] - y) >= APART_M for x, y in spots):
            spots.append(spot)
        if len(spots) == MAX_SPOTS:
            break
    return tuple(spots)


def _counter_clockwise(triangle: Floats) -> Floats:
    a, b, c = triangle
    turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return triangle if turn > 0 else triangle[::-1]
