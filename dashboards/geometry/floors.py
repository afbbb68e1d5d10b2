"""Floors: each room's polygon as a mesh in the colour of its kind."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from dashboards.palette import Colour, floor_colour
from workbench.worlds.geometry import Point
from workbench.worlds.house import FloorPlan, Room


@dataclass(frozen=True, slots=True, kw_only=True)
class Floor:
    """A room's floor: vertices float32 (V, 3) at height 0, faces uint32 (F, 3) seen from above, and its label."""

    room: str
    kind: str
    vertices: npt.NDArray[np.float32]
    faces: npt.NDArray[np.uint32]
    colour: Colour
    label_at: Point


def floors(plan: FloorPlan) -> tuple[Floor, ...]:
    """The floors of all rooms whose polygon encloses an area, in the plan's order."""
    return tuple(floor for room in plan.rooms if (floor := _floor(room)) is not None)


def _floor(room: Room) -> Floor | None:
    polygon = shapely.make_valid(shapely.Polygon(room.floor))
    if polygon.area < 1e-6:
        return None
    triangles = [
        np.asarray(t.exterior.coords)[:3]
        for t in shapely.constrained_delaunay_triangles(polygon).geoms
        if isinstance(t, shapely.Polygon) and t.area > 0
    ]
    corners = np.concatenate([_counter_clockwise(t) for t in triangles])
    vertices = np.column_stack([corners, np.zeros(len(corners))]).astype(np.float32)
    inside = polygon.representative_point() if not polygon.contains(polygon.centroid) else polygon.centroid
    return Floor(
        room=room.id,
        kind=room.kind,
        vertices=vertices,
        faces=np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        colour=floor_colour(room.kind),
        label_at=(float(inside.x), float(inside.y)),
    )


def _counter_clockwise(triangle: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    a, b, c = triangle
    turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return triangle if turn > 0 else triangle[::-1]
