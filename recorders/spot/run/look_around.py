"""The places of items seen during a look."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from recorders.spot.tags.item_places import Position
from workbench.worlds.house import ItemId

if TYPE_CHECKING:
    from recorders.spot.run.world import SpotWorld


def look_around(world: SpotWorld, start_ns: int, *, localized: bool) -> Mapping[ItemId, list[Position]] | None:
    """Every position on the map at which an item was seen since the start of a look, for as long as looks take, or
    until the operator skips it.

    Args:
        localized: whether the robot was localised when the look began.

    Returns:
        None if it never was.
    """
    seen: dict[ItemId, list[Position]] = {}
    while world.now_ns() - start_ns < round(world.settings.look_s * 1e9) and not world.requests.skipping:
        world.wait(world.settings.poll_s)
        sightings = world.sightings()
        localized = localized or sightings is not None
        for sighting in sightings or ():
            item = world.site.tags.get(sighting.tag)
            if item is not None and sighting.stamp_ns >= start_ns:
                seen.setdefault(item.id, []).append(sighting.position)
    return seen if localized else None
