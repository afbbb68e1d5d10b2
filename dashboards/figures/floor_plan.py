"""Floor plan from above: rooms, walls with their openings, outlines of furniture."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patheffects import withStroke

from dashboards.figures.style import as_map
from dashboards.geometry.floors import floors
from dashboards.model.labels import label
from dashboards.palette import floor_colour, unit_rgb
from workbench.arrays import Floats
from workbench.worlds.geometry import footprint
from workbench.worlds.house import FloorPlan
from workbench.worlds.names import readable_name
from workbench.worlds.walls import gaps_of

LOW_M = 1.0
"""Furniture that hangs higher than this is left out."""


def draw_floor_plan(ax: Axes, plan: FloorPlan, *, containers: Floats | None = None, room_names: bool = True) -> None:
    """Draws a place.

    Args:
        containers: colours of the containers, float (n, 3 or 4) within [0, 1]; white without.
    """
    as_map(ax)
    polygons = [room.floor for room in plan.rooms]
    faces = [(*unit_rgb(floor_colour(room.kind)), 0.55) for room in plan.rooms]
    ax.add_collection(PolyCollection(polygons, facecolors=faces, edgecolors="none", zorder=0))
    outlines = [footprint(f.pose, f.size_m[0], f.size_m[1]) for f in plan.furniture if f.base_m < LOW_M]
    ax.add_collection(
        PolyCollection(outlines, facecolors=(1, 1, 1, 0.5), edgecolors="#b5b9bf", linewidths=0.4, zorder=1)
    )
    boxes = [footprint(c.pose, c.size_m[0], c.size_m[1]) for c in plan.containers]
    if boxes:
        fills = containers if containers is not None else np.ones((len(boxes), 3))
        ax.add_collection(PolyCollection(boxes, facecolors=fills, edgecolors="#5a6068", linewidths=0.5, zorder=2))
    _draw_walls(ax, plan)
    if room_names:
        for floor in floors(plan):
            ax.text(
                *floor.label_at,
                label(readable_name(floor.kind)),
                ha="center",
                va="center",
                fontsize=6,
                color="#5a6068",
                zorder=6.5,
                path_effects=[withStroke(linewidth=1.8, foreground="white", alpha=0.85)],
            )
    ax.autoscale_view()


def _draw_walls(ax: Axes, plan: FloorPlan) -> None:
    whole: list[tuple[tuple[float, float], tuple[float, float]]] = []
    glass: list[tuple[tuple[float, float], tuple[float, float]]] = []
    for wall in plan.walls:
        if wall.empty:
            continue
        start, end = np.array(wall.start), np.array(wall.end)
        length = float(np.hypot(*(end - start)))
        if length <= 0:
            continue
        along = (end - start) / length
        at = 0.0
        for gap in gaps_of(wall, plan):
            a, b = _point(start + along * gap.start_m), _point(start + along * gap.end_m)
            if gap.is_door and gap.opening.passable:
                if gap.start_m > at:
                    whole.append((_point(start + along * at), a))
                at = max(at, gap.end_m)
            elif not gap.is_door:
                glass.append((a, b))
        if at < length:
            whole.append((_point(start + along * at), _point(end)))
    ax.add_collection(LineCollection(whole, colors="#34383f", linewidths=1.3, capstyle="projecting", zorder=3))
    ax.add_collection(LineCollection(glass, colors="#9cc8e0", linewidths=1.0, zorder=3.1))


def _point(values: Floats) -> tuple[float, float]:
    return (float(values[0]), float(values[1]))
