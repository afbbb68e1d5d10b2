"""The estimator `counts`: smoothed frequencies of items by container type and room kind, without training.

Frequencies are smoothed hierarchically, each level towards the previous one: how often any container holds the
item; how much more often this container type holds items than others; this room kind with this container type.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import final

import numpy as np

from workbench.arrays import AnyArray, Floats, Indices
from workbench.beliefs.belief import Belief
from workbench.beliefs.examples import Examples
from workbench.beliefs.weights import Weights
from workbench.caches import PerObject
from workbench.errors import BadValue, MalformedFile
from workbench.worlds.house import ContainerId, FloorPlan, ItemType
from workbench.worlds.knowledge import Knowledge

PSEUDO_ITEM = 10.0
PSEUDO_CONTAINER = 8.0
PSEUDO_TRIPLE = 5.0
"""Pseudo-counts of the previous level, chosen by log loss on validation houses."""

MIN_PROBABILITY, MAX_PROBABILITY = 1e-4, 0.98
"""Probabilities are clipped, so that no container is impossible or certain."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CountsTable:
    """P(held | room kind, container type, item type), with an extra last row on each axis for unknown names.

    Attributes:
        rooms, containers, items: names on the axes, without the extra row.
        probability: float64, shape (rooms + 1, containers + 1, items + 1), read-only.
    """

    rooms: tuple[str, ...]
    containers: tuple[str, ...]
    items: tuple[str, ...]
    probability: Floats

    def look_up(self, plan: FloorPlan, containers: tuple[ContainerId, ...], items: tuple[str, ...]) -> Floats:
        """Probabilities of containers of a floor plan, shape (items, containers)."""
        index, r, c = _ON_AXES.of(plan).get((self.rooms, self.containers), lambda: self._on_axes(plan))
        wanted = np.array([index[container] for container in containers], dtype=np.intp)
        places = _places(self.items, items)
        return self.probability[r[wanted][None, :], c[wanted][None, :], places[:, None]]

    def _on_axes(self, plan: FloorPlan) -> OnAxes:
        kind = {room.id: room.kind for room in plan.rooms}
        r = _places(self.rooms, tuple(kind[c.room] for c in plan.containers))
        index = {c.id: i for i, c in enumerate(plan.containers)}
        return index, r, _places(self.containers, tuple(c.type for c in plan.containers))


OnAxes = tuple[Mapping[ContainerId, int], Indices, Indices]
"""Containers of a floor plan by number, and their places on the axes of rooms and of containers."""

_ON_AXES: PerObject[tuple[tuple[str, ...], tuple[str, ...]], OnAxes] = PerObject(4)
"""By floor plan, for the names on these axes."""


def smooth(examples: Examples) -> CountsTable:
    """The table of smoothed shares."""
    seen, held = tallies(examples)
    base = (held.sum() + 0.05) / (seen.sum() + 1.0)
    item = _share(held.sum((0, 1)), seen.sum((0, 1)), base, PSEUDO_ITEM)
    container = _share(held.sum((0, 2)), seen.sum((0, 2)), base, PSEUDO_ITEM)
    pair = _share(held.sum(2), seen.sum(2), container[None, :], PSEUDO_ITEM)
    guess = np.clip(container[:, None] * item[None, :] / base, MIN_PROBABILITY, MAX_PROBABILITY)
    both = _share(held.sum(0), seen.sum(0), guess, PSEUDO_CONTAINER)
    lift = pair / container[None, :]
    triple = _share(
        held, seen, np.clip(both[None] * lift[:, :, None], MIN_PROBABILITY, MAX_PROBABILITY), PSEUDO_TRIPLE
    )
    return table_of(np.clip(triple, MIN_PROBABILITY, MAX_PROBABILITY), examples)


def tallies(examples: Examples) -> tuple[Floats, Floats]:
    """The counts `seen` and `held` of each triple, each of shape (rooms + 1, containers + 1, items + 1)."""
    shape = (len(examples.rooms) + 1, len(examples.containers) + 1, len(examples.items) + 1)
    seen, held = np.zeros(shape), np.zeros(shape)
    at = tuple(examples.triples.T)
    seen[at], held[at] = examples.seen, examples.held
    return seen, held


def table_of(values: Floats, examples: Examples) -> CountsTable:
    """Values on the axes of examples, to be looked up by names."""
    values.flags.writeable = False
    return CountsTable(rooms=examples.rooms, containers=examples.containers, items=examples.items, probability=values)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class CountsEstimator:
    """Looks up probabilities; observations during the run are ignored."""

    name: str
    table: CountsTable

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        unsearched = knowledge.unsearched
        probability = self.table.look_up(knowledge.plan, unsearched, item_types)
        return Belief(item_types=item_types, containers=unsearched, probability=probability, estimator=self.name)


def counts_tensors(examples: Examples) -> dict[str, AnyArray]:
    """The tensors of a weights file of counts: the examples as name indices and two counts."""
    return {
        "triples": examples.triples.astype(np.int32),
        "seen": examples.seen.astype(np.float32),
        "held": examples.held.astype(np.float32),
    }


def counts_settings(examples: Examples) -> dict[str, list[str]]:
    """The names of the axes, for the header of a weights file."""
    return {"rooms": [*examples.rooms], "containers": [*examples.containers], "items": [*examples.items]}


def examples_from(weights: Weights) -> Examples:
    """The examples in a weights file. Raises MalformedFile."""
    names = {axis: weights.names(axis) for axis in ("rooms", "containers", "items")}
    triples = weights.tensor("triples", None, 3).astype(np.int64)
    seen = weights.tensor("seen", len(triples)).astype(np.float64)
    held = weights.tensor("held", len(triples)).astype(np.float64)
    try:
        return Examples(**names, triples=triples, seen=seen, held=held)
    except BadValue as error:
        raise MalformedFile(weights.path, str(error).rstrip("."), "Train it again with lios train") from None


def counts_from(weights: Weights) -> CountsEstimator:
    """The estimator of a weights file. Raises MalformedFile."""
    return CountsEstimator(name=weights.name, table=smooth(examples_from(weights)))


def _share(held: Floats, seen: Floats, prior: Floats | float, pseudo: float) -> Floats:
    return np.asarray((held + pseudo * prior) / (seen + pseudo))


def _places(names: tuple[str, ...], wanted: tuple[str, ...]) -> Indices:
    index = _index(names)
    return np.array([index.get(name, len(names)) for name in wanted], dtype=np.intp)


@lru_cache(maxsize=64)
def _index(names: tuple[str, ...]) -> Mapping[str, int]:
    return {name: i for i, name in enumerate(names)}
