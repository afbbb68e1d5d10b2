"""Labelled training examples (room, container, item type) of houses, collapsed and weighted.

The paper labels every container of a house for every item type that the house holds: positive when the container
holds an instance, negative otherwise (Sec. IV-D). Its features are names only, so most rows are the same row
again: they collapse to distinct triples with how often each was seen and how often it held (about a
thirteenth of the rows).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.arrays import Floats, Ints
from workbench.errors import BadValue
from workbench.worlds.house import FloorPlan, House


@dataclass(frozen=True, slots=True, kw_only=True)
class Examples:
    """Distinct (room kind, container type, item type) triples with weights.

    Attributes:
        rooms, containers, items: the names, sorted; a triple holds their indices.
        triples: int64, shape (examples, 3), sorted.
        seen: float64, shape (examples,): how often a container of this kind stood in a house that holds the item.
        held: float64, shape (examples,): how often it held the item, at most `seen`.

    Raises:
        BadValue: the array shapes do not match, or `held` exceeds `seen`.
    """

    rooms: tuple[str, ...]
    containers: tuple[str, ...]
    items: tuple[str, ...]
    triples: Ints
    seen: Floats
    held: Floats

    def __post_init__(self) -> None:
        n = len(self.triples)
        if self.triples.shape != (n, 3) or self.seen.shape != (n,) or self.held.shape != (n,):
            shapes = (self.triples.shape, self.seen.shape, self.held.shape)
            raise BadValue("examples", shapes, "of shapes (n, 3), (n,), (n,)")
        sizes = (len(self.rooms), len(self.containers), len(self.items))
        if n and ((self.triples < 0).any() or (self.triples >= np.array(sizes)).any()):
            raise BadValue("triples of the examples", "an index", f"below {sizes}")
        finite = np.isfinite(self.seen).all() and np.isfinite(self.held).all()
        if not finite or (self.held < 0).any() or (self.held > self.seen).any():
            raise BadValue("examples", "held", "at least 0 and at most seen")

    @property
    def rows(self) -> float:
        """The weighted number of rows before collapsing."""
        return float(self.seen.sum())


def house_weight(house: House, *, single_room: float) -> float:
    """The training weight of a house: 1, or `single_room` for a house of one room, which says little about whole
    houses."""
    return single_room if len(house.plan.rooms) == 1 else 1.0


def collect(houses: Sequence[House], *, weights: Sequence[float] | None = None) -> Examples:
    """The examples of houses.

    Args:
        houses: the training houses.
        weights: weight of each house, default 1.

    Raises:
        BadValue: no house holds anything.
    """
    rooms = _names(room.kind for house in houses for room in house.plan.rooms)
    containers = _names(c.type for house in houses for c in house.plan.containers)
    items = _names(t for house in houses for t in house.item_types())
    if not items:
        raise BadValue("houses to learn from", len(houses), "at least one that holds an item")
    shape = (len(rooms), len(containers), len(items))
    seen, held = np.zeros(shape), np.zeros(shape)
    room_at, container_at, item_at = (_index(names) for names in (rooms, containers, items))
    for k, house in enumerate(houses):
        weight = 1.0 if weights is None else float(weights[k])
        present = [item_at[t] for t in house.item_types()]
        kinds = room_kinds(house.plan)
        for c, kind in zip(house.plan.containers, kinds, strict=True):
            r, t = room_at[kind], container_at[c.type]
            seen[r, t, present] += weight
            held[r, t, sorted({item_at[i.type] for i in house.contents[c.id]})] += weight
    triples = np.argwhere(seen > 0)
    at = tuple(triples.T)
    return Examples(
        rooms=rooms,
        containers=containers,
        items=items,
        triples=triples.astype(np.int64),
        seen=seen[at],
        held=held[at],
    )


def room_kinds(plan: FloorPlan) -> tuple[str, ...]:
    """The kind of the room of each container, in the plan's order."""
    kind = {room.id: room.kind for room in plan.rooms}
    return tuple(kind[c.room] for c in plan.containers)


def _names(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted(set(names)))


def _index(names: Sequence[str]) -> dict[str, int]:
    return {name: i for i, name in enumerate(names)}
