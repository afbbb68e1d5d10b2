"""The estimator `best`: placement rates by name, corrected by boosted trees on context features.

Names give the rates at which kinds of items are put into kinds of containers (`placements.py`); boosted trees on
the features of `context.py` correct these in log-odds. The belief is updated by evidence: observed items and
unsuccessful searches are features, learnt on partly searched houses.

Training is in `best.py`.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import prod
from typing import NamedTuple, final

import numpy as np

from workbench.arrays import Bools, Floats, Floats32
from workbench.beliefs.belief import Belief
from workbench.beliefs.boosted_trees.trees import Trees, trees_from
from workbench.beliefs.context import (
    ALIKE,
    FEATURES,
    FULL_HOUSE,
    FULL_ROOM,
    FULL_TYPE,
    NameOpinions,
    features,
    seen_types,
)
from workbench.beliefs.encoder import NameNotShipped, vectors_of
from workbench.beliefs.fcnn import DIGITS
from workbench.beliefs.observed_scene import ObservedScene, scene_of
from workbench.beliefs.placements import (
    Placements,
    condition_on_existence,
    exclude_furniture_rooms,
    placements_of,
)
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
            probability = _probability(logit)
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
        tables = _tables_whatever_else(self.trees, table, scene, opinions.usual, known_in_part, at_most)
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


def _probability(logit: Floats) -> Floats:
    return np.round(1.0 / (1.0 + np.exp(-np.clip(logit, -30.0, 30.0))), DIGITS)


class _Rise(NamedTuple):
    """A value of a feature that other items may lead to.

    Attributes:
        these: the open containers of one group, shape (open containers,).
        value: what the feature rises to there; -inf where it stays as known.
        least, most: how many other items in the searched containers of that group this takes, within SLACK.
    """

    feature: int
    these: Bools
    value: float
    least: float = 0.0
    most: float = np.inf


MAX_SHARED = 20_000
"""Limit on combinations of fullness that are looked through; in large houses they multiply."""
SLACK = 1e-6
"""Numbers of items are computed from logarithms; this much more or less than what is possible is still tried."""


def _tables_whatever_else(
    trees: Trees, table: Floats, scene: ObservedScene, usual: Floats, partly_known: Bools, at_most: int
) -> list[Floats] | None:
    """The probabilities for every combination of values of the features that other items may raise.

    Trees distinguish only on which side of a threshold a value is, so that a feature has few distinct values. The
    fullness of the house is one value for all pairs; the fullness of a room or of a type concerns the containers of
    that room or type; the most alike item concerns an item type and a room. Numbers of other items by room, and by
    type, add up to that of the house, which excludes many combinations.

    Args:
        table: the features as known, shape (features, items, open containers).
        usual: how many types each container usually holds, shape (containers,).
        partly_known: bool, shape (containers,).
    """
    if not partly_known.any():
        return [_probability(table[0] + trees.total(table.reshape(FEATURES, -1)).reshape(table.shape[1:]))]
    searched = np.array([held is not None for held in scene.seen])
    shared: list[list[_Rise]] = []
    unbounded: dict[int, bool] = {}
    types = np.unique(np.array(scene.types), return_inverse=True)[1]
    for feature, group, base in (
        (FULL_HOUSE, np.zeros(len(searched), dtype=np.int64), 4.0),
        (FULL_ROOM, scene.room, 2.0),
        (FULL_TYPE, types, 2.0),
    ):
        fuller, left = np.unique(group[partly_known]), group[scene.open]
        unbounded[feature] = not np.isin(fuller, left).all()
        for one in np.intersect1d(fuller, left):
            size = base + float(usual[searched & (group == one)].sum())
            shared.append(_rises(feature, left == one, trees, table[:, 0], size))
    room = scene.room[scene.open]
    alike_in = np.intersect1d(scene.room[partly_known], room)
    of_item = [
        [_rises(ALIKE, room == one, trees, table[:, item]) for one in alike_in] for item in range(table.shape[1])
    ]
    if _combinations(shared) > MAX_SHARED:
        return None
    together = [raised for raised in product(*shared) if _add_up(raised, unbounded)]
    if len(together) * max(map(_combinations, of_item)) > at_most:
        return None
    found: dict[bytes, Floats] = {}
    for raised in together:
        rows = [_rows(trees, table[:, k], raised, own) for k, own in enumerate(of_item)]
        if len(found) + prod(map(len, rows)) > at_most:
            return None
        for one in product(*rows):
            made = np.array(one)
            found.setdefault(made.tobytes(), made)
    return list(found.values())


def _rises(feature: int, these: Bools, trees: Trees, known: Floats, size: float | None = None) -> list[_Rise]:
    """The values that a feature can take in some open containers, the known one first.

    Args:
        known: the features of one item, shape (features, open containers).
        size: of a fullness, log((items + ...) / size): what a number of items is divided by.
    """
    cuts = np.unique(trees.threshold[trees.feature == feature])
    value = float(known[feature, these].min())
    above = [float(cut) for cut in cuts if cut >= value]
    if size is None:
        return [
            _Rise(feature, these, -np.inf),
            *(_Rise(feature, these, float(np.nextafter(c, np.inf))) for c in above),
        ]
    takes = [0.0, *(size * (float(np.exp(cut)) - float(np.exp(value))) for cut in above), np.inf]
    values = [-np.inf, *(float(np.nextafter(cut, np.inf)) for cut in above)]
    return [_Rise(feature, these, v, takes[k], takes[k + 1]) for k, v in enumerate(values)]


def _add_up(raised: Sequence[_Rise], unbounded: Mapping[int, bool]) -> bool:
    """Whether the numbers of other items that values of fullness take can add up to that of the house.

    Args:
        unbounded: by feature, whether some group may hold any number, since nothing in it is left to search.
    """
    (house,) = (rise for rise in raised if rise.feature == FULL_HOUSE)
    for feature in (FULL_ROOM, FULL_TYPE):
        those = [rise for rise in raised if rise.feature == feature]
        most = np.inf if unbounded[feature] else sum(rise.most for rise in those)
        if sum(rise.least for rise in those) > house.most + SLACK or most < house.least - SLACK:
            return False
    return True


def _combinations(choices: Sequence[Sequence[_Rise]]) -> int:
    return prod(map(len, choices))


def _rows(
    trees: Trees, known: Floats, raised: tuple[_Rise, ...], own: Sequence[Sequence[_Rise]]
) -> list[tuple[float, ...]]:
    """The distinct probabilities of one item in the open containers, for given values of the shared features."""
    columns = []
    for more in product(*own):
        column = known.copy()
        for rise in (*raised, *more):
            at = rise.feature, rise.these
            column[at] = np.maximum(column[at], rise.value)
        columns.append(column)
    made = np.concatenate(columns, axis=1)
    p = _probability(made[0] + trees.total(made)).reshape(len(columns), -1)
    return list(dict.fromkeys(map(tuple, p.tolist())))
