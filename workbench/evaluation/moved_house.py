"""Houses in which things have moved: a share of the items, drawn at random, stands where such things usually are."""

from __future__ import annotations

import numpy as np

from workbench.beliefs.estimators import estimator
from workbench.errors import BadValue
from workbench.plugins import NameOrigin
from workbench.worlds.house import ContainerId, House, Item
from workbench.worlds.knowledge import knowledge_at_start
from workbench.worlds.travel import TravelCosts

MOVER = "counts"
"""The estimator in proportion to whose belief new places are drawn: how often such a container holds such a thing."""


def moved_house(house: House, travel: TravelCosts, share: float, *, rng: np.random.Generator) -> House:
    """The house after a share of its items has moved, each to another container that can be reached.

    Args:
        share: of all items, rounded to whole ones; in [0, 1].

    Raises:
        BadValue: a share outside [0, 1].
    """
    if not 0 <= share <= 1:
        raise BadValue("share of moved items", share, "within [0, 1]")
    items = [(c.id, item) for c in house.plan.containers for item in house.contents[c.id]]
    count = round(share * len(items))
    chosen = set(rng.permutation(len(items))[:count].tolist())
    if not chosen:
        return house
    belief = estimator(MOVER, origin=NameOrigin.USER).believe(
        knowledge_at_start(house.plan, travel, {}), house.item_types()
    )
    containers = np.array(belief.containers)
    contents: dict[ContainerId, list[Item]] = {c.id: [] for c in house.plan.containers}
    for index, (at, item) in enumerate(items):
        chance = belief.of(item.type) * (containers != at)
        if index in chosen and chance.sum() > 0:
            at = belief.containers[int(rng.choice(len(chance), p=chance / chance.sum()))]
        contents[at].append(item)
    return House(plan=house.plan, contents={c: tuple(held) for c, held in contents.items()})
