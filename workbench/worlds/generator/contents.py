"""Contents of containers in generated houses, drawn with the item counts and types of such containers in real
houses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from workbench.worlds.generator.statistics import ContentShares, HouseStatistics
from workbench.worlds.names import is_container

SCENARIO_ITEMS = (
    "Apple",
    "Bowl",
    "Bread",
    "CoffeeMachine",
    "Egg",
    "Kettle",
    "Knife",
    "Mug",
    "Plate",
    "Pot",
    "Toaster",
)
"""Item types of the paper's scenarios that occur in real houses (the scenarios add coffee grinds and a water
bottle)."""


def draw_all_contents(
    statistics: HouseStatistics, furniture: Sequence[tuple[str, str]], rng: np.random.Generator, *, stocked: bool
) -> tuple[tuple[str, ...], ...]:
    """Draw the item types in each piece of furniture, given as (room kind, type).

    Args:
        stocked: in houses with a kitchen, add missing scenario items where the statistics place them.
    """
    contents = [
        list(draw_contents(statistics, room_kind=kind, container=container, rng=rng))
        if is_container(container)
        else []
        for kind, container in furniture
    ]
    if stocked and any(kind == "Kitchen" for kind, _ in furniture):
        for item in SCENARIO_ITEMS:
            if any(item in items for items in contents):
                continue
            weights = np.array([_share(statistics, kind, container, item) for kind, container in furniture])
            if weights.sum() > 0:
                contents[int(rng.choice(len(furniture), p=weights / weights.sum()))].append(item)
    return tuple(tuple(items) for items in contents)


def draw_contents(
    statistics: HouseStatistics, *, room_kind: str, container: str, rng: np.random.Generator
) -> tuple[str, ...]:
    """Draw the item types in one container, in random order; empty for a container without statistics.

    The number of items is drawn first, then types one by one. The weight of a type is the share of containers that
    hold it; after it has been drawn, the mean number of further instances.
    """
    shares = _shares(statistics, room_kind, container)
    if shares is None or not shares.types:
        return ()
    p = np.array(shares.number)
    number = int(rng.choice(len(p), p=p / p.sum()))
    return _draw_types(shares, number, rng)


def _draw_types(shares: ContentShares, number: int, rng: np.random.Generator) -> tuple[str, ...]:
    names = list(shares.types)
    weights = np.array([shares.types[name][0] for name in names])
    again = np.array([(mean - 1) / mean for _, mean in shares.types.values()])
    drawn: list[str] = []
    for _ in range(number):
        if weights.sum() <= 0:
            break
        which = int(rng.choice(len(names), p=weights / weights.sum()))
        weights[which] = again[which] * shares.types[names[which]][0]
        drawn.append(names[which])
    return tuple(drawn)


def _shares(statistics: HouseStatistics, room_kind: str, container: str) -> ContentShares | None:
    return statistics.contents.get(f"{room_kind}/{container}") or statistics.contents.get(f"/{container}")


def _share(statistics: HouseStatistics, room_kind: str, container: str, item: str) -> float:
    """The share of such containers that hold such an item."""
    shares = _shares(statistics, room_kind, container)
    return shares.types.get(item, (0.0, 0.0))[0] if shares else 0.0
