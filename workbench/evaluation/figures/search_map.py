"""A map of a search: the floor plan, the initial belief and the path taken."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from workbench.belief_colours import belief_colours
from workbench.beliefs.belief import Belief
from workbench.worlds.geometry import footprint
from workbench.worlds.house import START, Container, ContainerId, FloorPlan, House, ItemType, LocationId
from workbench.worlds.travel import Paths


def draw_search_map(
    ax: Axes,
    house: House,
    paths: Paths,
    item_type: ItemType,
    order: Sequence[ContainerId],
    *,
    belief: Belief,
    title: str,
    colour: str,
) -> None:
    """Draw a search on the map: from the start through the containers in order, and back.

    Args:
        belief: the initial belief; likelier containers are darker, and those that hold the item are ringed.
    """
    _draw_rooms(ax, house.plan)
    _draw_containers(ax, house, item_type, belief)
    stops = [START, *(LocationId(c) for c in order), START]
    for a, b in pairwise(stops):
        path = paths.path(a, b)
        if path is not None and len(path) > 1:
            xs, ys = zip(*path, strict=True)
            ax.plot(xs, ys, color=colour, linewidth=1.6, alpha=0.85, zorder=5)
    _draw_stops(ax, paths, order, colour)
    ax.set_aspect("equal")
    ax.set_axis_off()
    ax.set_title(title, fontsize=9)


def _draw_rooms(ax: Axes, plan: FloorPlan) -> None:
    for room in plan.rooms:
        ax.add_patch(
            Polygon(room.floor, closed=True, facecolor="#F4F1EA", edgecolor="#B9B4A8", linewidth=0.8, zorder=1)
        )
        x, y = np.mean(np.array(room.floor), axis=0)
        ax.text(x, y, room.kind, fontsize=6, color="#8A8578", ha="center", va="center", zorder=2)
    for wall in plan.walls:
        if not wall.empty:
            ax.plot(*zip(wall.start, wall.end, strict=True), color="#4A4E57", linewidth=1.4, zorder=2)
    for door in plan.doors:
        if door.passable:
            ax.plot(*zip(door.start, door.end, strict=True), color="#F4F1EA", linewidth=2.4, zorder=3)
    ax.autoscale_view()


def _draw_containers(ax: Axes, house: House, item_type: ItemType, belief: Belief) -> None:
    row = dict(zip(belief.containers, belief.of(item_type), strict=True))
    most = max(row.values(), default=0.0) or 1.0
    holders = frozenset(house.holders(item_type))
    for container in house.plan.containers:
        holds = container.id in holders
        ax.add_patch(
            Polygon(
                _outline(container),
                closed=True,
                facecolor=belief_colours(row.get(container.id, 0.0) / most) / 255,
                edgecolor="#009E73" if holds else "#6B6B6B",
                linewidth=2.2 if holds else 0.5,
                zorder=4,
            )
        )


def _outline(container: Container) -> tuple[tuple[float, float], ...]:
    return footprint(container.pose, container.size_m[0], container.size_m[1])


def _draw_stops(ax: Axes, paths: Paths, order: Sequence[ContainerId], colour: str) -> None:
    start = paths.standing_pose(START)
    if start is not None:
        ax.plot(*start.point, marker="s", color="black", markersize=5, zorder=7)
    for number, container in enumerate(order, start=1):
        pose = paths.standing_pose(LocationId(container))
        if pose is not None:
            ax.plot(*pose.point, marker="o", color=colour, markersize=8, zorder=6)
            ax.text(*pose.point, str(number), fontsize=5.5, color="white", ha="center", va="center", zorder=7)
