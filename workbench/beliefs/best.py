"""The estimator `best`: placement rates by name, corrected by boosted trees on context features.

Names give the rates at which kinds of items are put into kinds of containers (`placements.py`); boosted trees on
the features of `context.py` correct these in log-odds. The belief is updated by evidence: observed items and
unsuccessful searches are features, learnt on partly searched houses.

The beliefs that contents which nobody saw can lead to are in `possible_beliefs.py`, training in `training/best.py`.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import final

import numpy as np

from workbench.arrays import Floats, Floats32
from workbench.beliefs.belief import Belief
from workbench.beliefs.boosted_trees.trees import Trees, trees_from
from workbench.beliefs.context import FEATURES, NameOpinions, features, seen_types
from workbench.beliefs.encoder import NameNotShipped, vectors_of
from workbench.beliefs.fcnn import DIGITS
from workbench.beliefs.observed_scene import ObservedScene, scene_of
from workbench.beliefs.placements import (
    Placements,
    condition_on_existence,
    exclude_furniture_rooms,
    placements_of,
)
from workbench.beliefs.possible_beliefs import probability_of, tables_whatever_else
from workbench.beliefs.weights import Weights
from workbench.caches import PerObject
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.names import usual_size_m

OPINION_CACHE_SIZE = 256
"""Number of (house, items) pairs whose name-based opinions are cached."""

VECTOR_CACHE_SIZE = 10_000

_CacheKey = tuple[tuple[str, ...], tuple[str, ...], tuple[int, ...], tuple[tuple[str, ...], ...], tuple[str, ...]]
"""Cache key: room kind, container type and room of each container; furniture of each room; and item types."""


@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True)
class NameModel:
    """Name-based opinions about a scene: looked-up placements, and similarities between names."""

    placements: Placements

    def opinions(self, scene: ObservedScene, items: tuple[str, ...]) -> NameOpinions:
        """Name-based opinions about items in all containers of a scene; only the similarities change between
        looks."""
        asked = (scene.kinds, scene.types, tuple(scene.room.tolist()), scene.stands, items)
        formed = _OPINIONS.of(self).get(asked, lambda: self._compute_opinions(scene, items))
        return replace(formed, likeness=self._similarity(items, seen_types(scene)))

    def _compute_opinions(self, scene: ObservedScene, items: tuple[str, ...]) -> NameOpinions:
        known = self.placements
        places = known.places(scene.kinds, scene.types)
        several = known.duplicate_probabilities(items)
        rates = known.rates_at(scene.kinds, scene.types, items)
        rates = exclude_furniture_rooms(rates, several, items, scene.room, scene.stands)
        return NameOpinions(
            rates=rates,
            closed=condition_on_existence(rates, several, scene.room),
            several=several,
            often=known.occurrences(items),
            size_m=np.array([usual_size_m(i) for i in items]).reshape(-1, 3),
            stood=known.stood[places],
            usual=known.usual[places],
            likeness=np.zeros((len(items), 0)),
        )

    def _similarity(self, items: Sequence[str], types: Sequence[str]) -> Floats:
        """Cosine similarities, shape (items, types); 0 for an observed type that cannot be encoded."""
        if not types:
            return np.zeros((len(items), 0))
        found = [self._vector(t) for t in types]
        zero = np.zeros_like(vectors_of(self.placements.encoder, items[:1])[0])
        seen = np.array([zero if v is None else v for v in found], dtype=np.float64)
        asked = np.array([zero if v is None else v for v in map(self._vector, items)], dtype=np.float64)
        return np.round(asked @ seen.T, DIGITS)

    def _vector(self, name: str) -> Floats32 | None:
        return _VECTORS.of(self).get(name, lambda: self._encoded(name))

    def _encoded(self, name: str) -> Floats32 | None:
        try:
            return vectors_of(self.placements.encoder, [name])[0]
        except NameNotShipped:
            return None


_OPINIONS: PerObject[_CacheKey, NameOpinions] = PerObject(OPINION_CACHE_SIZE)
_VECTORS: PerObject[str, Floats32 | None] = PerObject(VECTOR_CACHE_SIZE)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class BestEstimator:
    """The estimator that combines name-based opinions with context features."""

    name: str
    names: NameModel
    trees: Trees

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        """The belief over unsearched containers.

        Raises:
            NameNotShipped: an item name cannot be encoded.
        """
        scene = scene_of(knowledge)
        shape = (len(item_types), int(scene.open.sum()))
        probability = np.zeros(shape)
        if probability.size:
            table = features(scene, item_types, self.names.opinions(scene, item_types))
            logit = table[0] + self.trees.total(table.reshape(FEATURES, -1)).reshape(shape)
            probability = probability_of(logit)
        return Belief(
            item_types=item_types, containers=knowledge.unsearched, probability=probability, estimator=self.name
        )

    def beliefs_whatever_else(
        self,
        knowledge: Knowledge,
        item_types: tuple[ItemType, ...],
        partly_known: Collection[ContainerId],
        *,
        at_most: int,
    ) -> tuple[Belief, ...] | None:
        """Every belief that other items in some searched containers can lead to; perhaps others besides.

        Args:
            item_types: types of which these containers hold no other instance than `knowledge` says.
            partly_known: searched containers that hold what `knowledge` says, and any items of other types.
            at_most: how many beliefs are enumerated.

        Returns:
            None where there are more. Where nothing is partly known or nothing left to search, the belief itself.
        """
        scene = scene_of(knowledge)
        if not scene.open.any() or not item_types:
            return (self.believe(knowledge, item_types),)
        opinions = self.names.opinions(scene, item_types)
        table = features(scene, item_types, opinions)
        known_in_part = np.array([c.id in partly_known for c in knowledge.plan.containers])
        tables = tables_whatever_else(self.trees, table, scene, opinions.usual, known_in_part, at_most)
        if tables is None:
            return None
        return tuple(
            Belief(item_types=item_types, containers=knowledge.unsearched, probability=p, estimator=self.name)
            for p in tables
        )


def best_from(weights: Weights) -> BestEstimator:
    """The estimator of a weights file.

    Raises:
        MalformedFile: the weights do not fit this estimator.
    """
    return BestEstimator(
        name=weights.name,
        names=NameModel(placements=placements_of(weights)),
        trees=trees_from(weights, features=FEATURES),
    )
