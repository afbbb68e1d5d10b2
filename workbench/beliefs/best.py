"""The estimator `best`: placement rates by name, corrected by boosted trees on context features.

Names give the rates at which kinds of items are put into kinds of containers (`placements.py`); boosted trees on
the features of `context.py` correct these in log-odds. The belief is updated by evidence: observed items and
unsuccessful searches are features, learnt on partly searched houses.

Training is in `best.py`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import prod
from typing import NamedTuple, final

import numpy as np

from workbench.arrays import Bools, Floats, Floats32, Ints
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
        these: the open containers that have it, shape (open containers,).
        value: what the feature rises to there; -inf where it stays as known.
        takes: of a fullness, more than how many other items that takes.
    """

    feature: int
    these: Bools
    value: float
    takes: float = 0.0


class _Fullness(NamedTuple):
    """How full the searched containers of the house, of a room or of a type are.

    Attributes:
        rises: the values that it can take, the known one first.
        counts: which of the places of other items it counts, shape (places,).
    """

    rises: list[_Rise]
    counts: Bools


MAX_COUNTS = 20_000
"""Limit on combinations of numbers of other items that are looked through; with many searched containers they
multiply."""
SLACK = 1e-6
"""Numbers of items are computed from logarithms; this much more or less than what is possible is still tried."""


def _tables_whatever_else(
    trees: Trees, table: Floats, scene: ObservedScene, usual: Floats, partly_known: Bools, at_most: int
) -> list[Floats] | None:
    """The probabilities for every combination of values of the features that other items may raise.

    Trees distinguish only on which side of a threshold a value is, so that a feature has few distinct values. The
    fullness of the house is one value for all pairs; the fullness of a room or of a type concerns the containers of
    that room or type; the most alike item concerns an item type and a room. All of these follow from how many other
    items are in the partly known containers of each room and type, and which: where there are none, nothing rises.

    Args:
        table: the features as known, shape (features, items, open containers).
        usual: how many types each container usually holds, shape (containers,).
        partly_known: bool, shape (containers,).
    """
    if not partly_known.any():
        return [_probability(table[0] + trees.total(table.reshape(FEATURES, -1)).reshape(table.shape[1:]))]
    types = np.unique(np.array(scene.types), return_inverse=True)[1]
    places = np.unique(np.stack([scene.room, types], axis=1)[partly_known], axis=0)
    rooms = np.intersect1d(places[:, 0], scene.room[scene.open])
    fullness = list(_fullness(trees, table, scene, usual, types, places))
    together = _together(fullness, [places[:, 0] == one for one in rooms])
    if together is None:
        return None
    room = scene.room[scene.open]
    alike = [[_rises(ALIKE, room == one, trees, table[:, k]) for one in rooms] for k in range(table.shape[1])]
    if len(together) > at_most:
        return None
    found: dict[bytes, Floats] = {}
    by_rooms: dict[tuple[bool, ...], list[Floats]] = {}
    for raised, others in together:
        if others not in by_rooms:
            own = [[rises if other else rises[:1] for rises, other in zip(of, others, strict=True)] for of in alike]
            if max(map(_combinations, own)) > at_most:
                return None
            by_rooms[others] = [_alike_rows(table[:, k], of) for k, of in enumerate(own)]
        rows = [_rows(trees, table[:, k], raised, of) for k, of in enumerate(by_rooms[others])]
        if len(found) + prod(map(len, rows)) > at_most:
            return None
        for one in product(*rows):
            made = np.array(one)
            found.setdefault(made.tobytes(), made)
    return list(found.values())


def _fullness(
    trees: Trees, table: Floats, scene: ObservedScene, usual: Floats, types: Ints, places: Ints
) -> Iterator[_Fullness]:
    """The values of fullness that other items can raise, where they concern an open container.

    Args:
        types: int64, shape (containers,), the index of each container's type.
        places: rooms and types of partly known containers, shape (places, 2), each pair once.
    """
    searched = np.array([held is not None for held in scene.seen])
    house = np.zeros(len(searched), dtype=np.int64)
    for feature, group, of_place, base in (
        (FULL_HOUSE, house, 0 * places[:, 0], 4.0),
        (FULL_ROOM, scene.room, places[:, 0], 2.0),
        (FULL_TYPE, types, places[:, 1], 2.0),
    ):
        left = group[scene.open]
        for one in np.intersect1d(of_place, left):
            size = base + float(usual[searched & (group == one)].sum())
            yield _Fullness(_rises(feature, left == one, trees, table[:, 0], size), of_place == one)


def _rises(feature: int, these: Bools, trees: Trees, known: Floats, size: float = 1.0) -> list[_Rise]:
    """The values that a feature can take in some open containers, the known one first.

    Args:
        known: the features of one item, shape (features, open containers).
        size: of a fullness, log((items + ...) / size): what a number of items is divided by.
    """
    cuts = np.unique(trees.threshold[trees.feature == feature])
    value = float(known[feature, these].min())
    above = [float(cut) for cut in cuts if cut >= value]
    return [
        _Rise(feature, these, -np.inf),
        *(
            _Rise(feature, these, float(np.nextafter(cut, np.inf)), size * float(np.exp(cut) - np.exp(value)))
            for cut in above
        ),
    ]


def _together(
    fullness: Sequence[_Fullness], in_rooms: Sequence[Bools]
) -> list[tuple[tuple[_Rise, ...], tuple[bool, ...]]] | None:
    """Which values of fullness occur together, and in which rooms there are other items then; None where there are
    too many numbers of other items.

    Args:
        in_rooms: for each room, which places are in it, shape (places,).
    """
    passed = [
        *(_passed([rise.takes for rise in each.rises[1:]]) for each in fullness),
        *(_passed([0.5]) for _ in in_rooms),
    ]
    counts = np.stack([*(each.counts for each in fullness), *in_rooms])
    enough = np.array([len(each.least) - 1 for each in passed])
    numbers = np.zeros((1, len(counts)), dtype=np.int64)
    for k, place in enumerate(counts.T):
        items = np.arange(int(enough[place].max(initial=0)) + 1)
        if len(numbers) * len(items) > MAX_COUNTS:
            return None
        numbers = np.minimum(numbers[:, None, :] + items[:, None] * place, enough).reshape(-1, len(counts))
        for which in np.flatnonzero(place & ~counts[:, k + 1 :].any(axis=1)):  # no later place adds to it
            numbers[:, which] = passed[which].alike[numbers[:, which]]
        numbers = _distinct(numbers, enough)
    found: dict[tuple[int, ...], None] = {}
    for row in numbers.tolist():
        which = [range(int(each.least[n]), int(each.most[n]) + 1) for each, n in zip(passed, row, strict=True)]
        found.update(dict.fromkeys(product(*which)))
    return [
        (
            tuple(each.rises[k] for each, k in zip(fullness, chosen, strict=False)),
            tuple(k > 0 for k in chosen[len(fullness) :]),
        )
        for chosen in found
    ]


def _distinct(numbers: Ints, most: Ints) -> Ints:
    """The distinct rows, sorted: numpy.unique of rows takes many times as long as of a code for each."""
    if prod((most + 1).tolist()) > 2**62:
        return np.unique(numbers, axis=0)
    weights = np.append(np.cumprod((most + 1)[:0:-1])[::-1], 1)
    return numbers[np.unique(numbers @ weights, return_index=True)[1]]


class _Passed(NamedTuple):
    """Which thresholds numbers of items pass, from none to as many as pass all; int64, shape (numbers,): at least and
    at most how many, within SLACK, and the least number that passes as many."""

    least: Ints
    most: Ints
    alike: Ints


def _passed(takes: Sequence[float]) -> _Passed:
    """
    Args:
        takes: thresholds, ascending; a number passes one if it is larger.
    """
    numbers = np.arange(int(max(takes, default=-1.0) + SLACK) + 2)
    least, most = np.searchsorted(takes, numbers - SLACK), np.searchsorted(takes, numbers + SLACK, side="right")
    _, first, which = np.unique(np.stack([least, most]), axis=1, return_index=True, return_inverse=True)
    return _Passed(least, most, first[which])


def _combinations(choices: Sequence[Sequence[_Rise]]) -> int:
    return prod(map(len, choices))


def _alike_rows(known: Floats, own: Sequence[Sequence[_Rise]]) -> Floats:
    """How alike the most alike items may be, for every combination of other items in the rooms; shape (combinations,
    open containers)."""
    rows = np.repeat(known[ALIKE][None], _combinations(own), axis=0)
    for row, more in zip(rows, product(*own), strict=True):
        for rise in more:
            row[rise.these] = np.maximum(row[rise.these], rise.value)
    return rows


def _rows(trees: Trees, known: Floats, raised: tuple[_Rise, ...], alike: Floats) -> list[tuple[float, ...]]:
    """The distinct probabilities of one item in the open containers, for given values of the shared features.

    Args:
        alike: how alike the most alike items are, shape (combinations, open containers).
    """
    column = known.copy()
    for rise in raised:
        at = rise.feature, rise.these
        column[at] = np.maximum(column[at], rise.value)
    columns = np.repeat(column[:, None, :], len(alike), axis=1)
    columns[ALIKE] = alike
    made = columns.reshape(len(known), -1)
    p = _probability(made[0] + trees.total(made)).reshape(len(alike), -1)
    return list(dict.fromkeys(map(tuple, p.tolist())))
