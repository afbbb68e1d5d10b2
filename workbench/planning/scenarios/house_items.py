"""Requirements of scenarios on a house: items added to it, and the error if it lacks something."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from workbench.errors import Unsupported
from workbench.worlds.house import House, Item, ItemId, ItemType
from workbench.worlds.names import readable_name

SERVING_TYPES = ("DiningTable", "CounterTop", "CoffeeTable", "SideTable", "Desk")
"""Where breakfast and coffee are served: at the first of these types that the house has."""


class ScenarioUnsupported(Unsupported):
    """A house lacks what a scenario needs.

    Attributes:
        house, scenario, lacks: the parts of the message, for statistics.
    """

    def __init__(self, house: str, scenario: str, lacks: str) -> None:
        self.house, self.scenario, self.lacks = house, scenario, lacks
        super().__init__(f"{house} cannot support {scenario}: it has {lacks}. Choose another house.")


def add_item(
    house: House, item_type: ItemType, stands: tuple[str, ...], *, scenario: str, rng: np.random.Generator
) -> House:
    """The house with one more item in a container of one of these types, unless it holds one already."""
    if house.holders(item_type):
        return house
    places = [c.id for c in house.plan.containers if c.type in stands]
    if not places:
        wanted = ", ".join(readable_name(stand) for stand in stands)
        raise ScenarioUnsupported(house.plan.name, scenario, f"no {wanted} for the {readable_name(item_type)}")
    place = places[int(rng.integers(len(places)))]
    item = Item(id=_added_id(item_type), type=item_type)
    return replace(house, contents={**house.contents, place: (*house.contents[place], item)})


def was_added(house: House, item_type: ItemType) -> bool:
    """Whether add_item put this item into the house."""
    return any(item.id == _added_id(item_type) for items in house.contents.values() for item in items)


def _added_id(item_type: ItemType) -> ItemId:
    return ItemId(f"{item_type}|added")
