"""Where a driven robot has arrived, and which item is nearest to it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import hypot

from recorders.spot.tags.item_places import Position
from workbench.worlds.geometry import Point
from workbench.worlds.house import Item, ItemId, LocationId
from workbench.worlds.sites.site import Site

ARRIVAL_RADIUS_M = 0.8
"""A robot within this many metres of a standing pose is at that location."""
UNSEEN_M = 99.0
"""The distance of an item whose tag was not seen."""


def nearest_location(site: Site, point: Point) -> LocationId | None:
    """The location at whose standing pose a robot is; None if it is at none."""
    away = [
        (hypot(pose.x_m - point[0], pose.y_m - point[1]), name)
        for name in site.travel.locations
        if (pose := site.paths.standing_pose(name)) is not None
    ]
    best = min(away, default=None)
    return best[1] if best is not None and best[0] <= ARRIVAL_RADIUS_M else None


def nearest_item(items: Iterable[Item], point: Point, seen_at: Mapping[ItemId, Position]) -> Item | None:
    """The item whose tag is nearest to a point; None where there are none.

    Args:
        seen_at: where tags were seen last.
    """

    def away(item: Item) -> float:
        at = seen_at.get(item.id)
        return UNSEEN_M if at is None else hypot(at[0] - point[0], at[1] - point[1])

    return min(items, key=away, default=None)
