"""How often does a container of this kind hold this item, whatever the house? Rates, and what follows from them.

The counts (`counts.py`) are of houses that hold the item, and so depend on how large those houses are: in a house of
one room, every container holds a larger share of what there is. A rate is over all containers of a kind, so houses
of all sizes teach it alike. Conditioning comes later, in the house at hand: given that the item is in one of the
containers, it is in this one with the rate over the chance of any.

Smoothed like the counts, with one step more: how often rooms of this kind hold the item.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from workbench.beliefs.examples import Examples, room_kinds
from workbench.worlds.house import House

Floats = npt.NDArray[np.float64]

PSEUDO_ITEM, PSEUDO_CONTAINER, PSEUDO_PLACE = 2.0, 10.0, 100.0
PSEUDO_ROOM, PSEUDO_BOTH, PSEUDO_TRIPLE = 20.0, 40.0, 20.0
"""How many unseen containers the step before is worth, chosen by cross-validation over the training houses."""

LEAST, MOST = 1e-6, 0.98


def rates_of(houses: Sequence[House], examples: Examples) -> Floats:
    """Smoothed rates on the axes of examples, with one more entry each for an unknown name.

    An item type is counted as absent only from houses of a source (a file) that has it at all: the older ProcTHOR
    houses know nothing of Objaverse things.

    Returns:
        float64 rounded to float32, as it is shipped: shape (rooms + 1, containers + 1, items + 1).
    """
    held, seen = _tallies(houses, examples)
    base = (held.sum() + 0.01) / (seen.sum() + 1.0)
    item = _towards(held.sum((0, 1)), seen.sum((0, 1)), base, PSEUDO_ITEM)
    container = _towards(held.sum((0, 2)), seen.sum((0, 2)), base, PSEUDO_CONTAINER)
    place = _towards(held.sum(2), seen.sum(2), container[None, :], PSEUDO_PLACE)
    room = _towards(held.sum(1), seen.sum(1), item[None, :], PSEUDO_ROOM)
    guess = np.clip(container[:, None] * item[None, :] / base, LEAST, MOST)
    both = _towards(held.sum(0), seen.sum(0), guess, PSEUDO_BOTH)
    lift = (place / container[None, :])[:, :, None] * np.sqrt(room / item[None, :])[:, None, :]
    triple = _towards(held, seen, np.clip(both[None] * lift, LEAST, MOST), PSEUDO_TRIPLE)
    return np.clip(triple, LEAST, MOST).astype(np.float32).astype(np.float64)


def given_that_it_is_here(rates: Floats) -> Floats:
    """The chance of each container, given that one of them holds the item: shape (items, containers) of both."""
    if not rates.size:
        return rates
    anywhere = -np.expm1(np.log1p(-rates).sum(axis=1, keepdims=True))
    return rates / anywhere


def _tallies(houses: Sequence[House], examples: Examples) -> tuple[Floats, Floats]:
    """How many containers of each kind held the item, and how many there were that could have."""
    shape = (len(examples.rooms) + 1, len(examples.containers) + 1, len(examples.items) + 1)
    held, seen = np.zeros(shape), np.zeros(shape)
    rooms, containers, items = (
        {name: k for k, name in enumerate(names)} for names in (examples.rooms, examples.containers, examples.items)
    )
    sources: dict[str, list[House]] = {}
    for house in houses:
        sources.setdefault(house.plan.name.partition(":")[0], []).append(house)
    for several in sources.values():
        known = sorted({items[t] for house in several for t in house.item_types()})
        for house in several:
            for container, kind in zip(house.plan.containers, room_kinds(house.plan), strict=True):
                r, c = rooms[kind], containers[container.type]
                seen[r, c, known] += 1
                held[r, c, sorted({items[i.type] for i in house.contents[container.id]})] += 1
    return held, seen


def _towards(held: Floats, seen: Floats, prior: Floats | float, pseudo: float) -> Floats:
    return np.asarray((held + pseudo * prior) / (seen + pseudo))
