"""Context features of an item in a container, beyond names, as known during a search.

Names give rates and probabilities (`placements.py`). The features add: competing containers in the room and in the
house; the size of the container, and whether the item fits; the composition of the house; and the observations so
far: how full containers are compared with the usual, where the item was not found, and what stands in the same
room.

Every feature is a function of one container, or a sum or maximum over containers, so that the order of containers
has no influence.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from workbench.arrays import Floats
from workbench.beliefs.observed_scene import ROOM_KINDS, ObservedScene
from workbench.beliefs.placement_mixture import MAX_RATE, MIN_RATE
from workbench.beliefs.placements import condition_on_existence

MIN_PROBABILITY = 1e-4
"""Probabilities are clipped to [MIN_PROBABILITY, 1 - MIN_PROBABILITY]."""

FEATURES = 55
"""Number of features; weights depend on their order. The first is the log-odds of the name-based probability."""

ALIKE, FULL_ROOM, FULL_TYPE, FULL_HOUSE = 23, 24, 25, 26
"""The features that depend on which other items were observed: how alike the most alike of them in the room is, and
how full the searched containers are of the room, of the type, and of the house. More items observed in a searched
container never lower any of them, and change no other feature."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NameOpinions:
    """Name-based opinions about the items.

    Attributes:
        rates: rate at which such a container holds the item, shape (items, containers), over all containers of
            the scene.
        closed: probability that each container holds the item before any search, same shape.
        several: probability that a room may hold the item in two containers, shape (items,).
        often: number of training occurrences of the item, shape (items,).
        size_m: usual (depth, width, height) of the items in metres, shape (items, 3).
        stood: number of training containers of this kind, shape (containers,).
        usual: how many types a container of this kind usually holds, shape (containers,).
        likeness: cosine similarity of the item and each observed type, shape (items, observed types).
    """

    rates: Floats
    closed: Floats
    several: Floats
    often: Floats
    size_m: Floats
    stood: Floats
    usual: Floats
    likeness: Floats


def seen_types(scene: ObservedScene) -> tuple[str, ...]:
    """All observed item types, sorted."""
    return tuple(sorted({t for held in scene.seen if held is not None for t in held}))


def features(scene: ObservedScene, items: tuple[str, ...], opinions: NameOpinions) -> Floats:
    """Features of every item in every open container, shape (features, items, open containers)."""
    same = _Same(room=_is_same(scene.room.tolist()), type=_is_same(scene.types))
    columns: list[Floats | float] = [
        *_competition(scene, same, opinions),
        *_support(scene, opinions),
        *_evidence(scene, same, items, opinions),
        *(column[:, None] for column in _items(opinions)),
        *_containers(scene, same, opinions),
    ]
    table = np.empty((len(columns), len(items), int(scene.open.sum())))
    for row, column in zip(table, columns, strict=True):
        row[:] = column
    return table


class _Same(NamedTuple):
    """Which containers are in one room, and of one type: 1 or 0, shape (containers, containers)."""

    room: Floats
    type: Floats


def _is_same(values: Sequence[Hashable]) -> Floats:
    """Where two of several values are equal: 1 or 0, shape (values, values)."""
    number = {value: k for k, value in enumerate(dict.fromkeys(values))}
    numbers = np.array([number[value] for value in values], dtype=np.int64)
    return (numbers[:, None] == numbers[None, :]).astype(np.float64)


def _competition(scene: ObservedScene, same: _Same, opinions: NameOpinions) -> list[Floats]:
    """Features of competition with the other unsearched containers, in the room and in the house."""
    is_open, several = scene.open, opinions.several
    rates, room = opinions.rates[:, is_open], scene.room[is_open]
    p = _clip(condition_on_existence(rates, several, room))
    breadth = np.sqrt(_top_m2(scene))[is_open]
    in_one_room = same.room[np.ix_(is_open, is_open)]
    large, wide, rate_large = p * breadth, p * np.sqrt(breadth), rates * breadth
    as_rates = rate_large * (rates.sum(axis=1, keepdims=True) / rate_large.sum(axis=1, keepdims=True))
    by_area = condition_on_existence(np.clip(as_rates, MIN_RATE, MAX_RATE), several, room)
    in_room, in_house = p @ in_one_room, p.sum(axis=1, keepdims=True)
    share = p / in_house
    return [
        _logit(p),
        np.log(rates),
        np.log(rates / rates.sum(axis=1, keepdims=True)),
        np.log(rates / (rates @ in_one_room)),
        np.log(rate_large / rate_large.sum(axis=1, keepdims=True)),
        _logit(_clip(by_area)),
        np.log(wide / wide.sum(axis=1, keepdims=True)),
        np.log(p / in_room),
        np.log(share),
        np.log(in_room),
        np.log(in_house),
        np.log(in_room / in_house),
        np.log(p / p.max(axis=1, keepdims=True)),
        np.log(large / (large @ in_one_room)),
        np.log(large / large.sum(axis=1, keepdims=True)),
        np.log1p((p[:, None, :] > p[:, :, None] * 1.0000001).sum(axis=2)),
        -(share * np.log(share)).sum(axis=1, keepdims=True),
    ]


def _support(scene: ObservedScene, opinions: NameOpinions) -> list[Floats]:
    """Features of whether the item fits on the container."""
    is_open = scene.open
    sides = np.sort(opinions.size_m[:, :2], axis=1)
    narrow = scene.size_m[is_open, :2].min(axis=1)
    return [
        np.log((sides.prod(axis=1) + 1e-4)[:, None] / _top_m2(scene)[None, is_open]),
        narrow[None, :] - sides[:, 1:],
    ]


def _evidence(
    scene: ObservedScene, same: _Same, items: tuple[str, ...], opinions: NameOpinions
) -> list[Floats | float]:
    """Features of observed items and unsuccessful searches."""
    is_open = scene.open
    searched = np.array([held is not None for held in scene.seen], dtype=np.float64)
    in_room, of_type = same.room[is_open], same.type[is_open]
    p = _clip(opinions.closed)
    types = seen_types(scene)
    number = {t: k for k, t in enumerate(types)}
    here = np.zeros((len(types), len(scene.seen)))
    for container, held in enumerate(scene.seen):
        for t in held or ():
            here[number[t], container] = 1.0
    is_it = np.zeros((len(items), len(types)))
    for k, item in enumerate(items):
        if item in number:
            is_it[k, number[item]] = 1.0
    found = is_it @ here
    alike = np.where(((in_room @ here.T) > 0)[None], opinions.likeness[:, None, :], 0.0)
    alike = np.where(is_it[:, None, :] > 0, 0.0, alike)
    full = np.array([len(set(held)) if held is not None else 0 for held in scene.seen], dtype=np.float64)
    usual = opinions.usual * searched
    return [
        np.log1p((p * searched) @ in_room.T),
        np.log1p((p * searched).sum(axis=1, keepdims=True)),
        np.log1p(found @ in_room.T),
        np.log1p(found.sum(axis=1, keepdims=True)),
        alike.max(axis=2, initial=0.0),
        np.log((in_room @ full + 2) / (in_room @ usual + 2)),
        np.log((of_type @ full + 2) / (of_type @ usual + 2)),
        float(np.log((full.sum() + 4) / (usual.sum() + 4))),
        (in_room @ searched) / in_room.sum(axis=1),
        float(searched.mean()),
    ]


def _items(opinions: NameOpinions) -> list[Floats]:
    return [np.log1p(opinions.often), opinions.several, opinions.size_m[:, 2]]


def _containers(scene: ObservedScene, same: _Same, opinions: NameOpinions) -> list[Floats | float]:
    """Features of the unsearched containers: size, room, house."""
    is_open = scene.open
    kinds = np.array(scene.kinds, dtype=object)[is_open]
    in_room, of_type = same.room[is_open], same.type[is_open]
    area = _top_m2(scene)
    of_kind = [float(sum(kind == k for kind in scene.rooms)) for k in ROOM_KINDS]
    return [
        *scene.size_m[is_open].T,
        np.log(area[is_open]),
        np.log(area[is_open] / (in_room @ area)),
        np.log(scene.room_m2[scene.room[is_open]] + 0.1),
        np.log(in_room.sum(axis=1)),
        np.log((in_room * of_type).sum(axis=1)),
        np.log(of_type.sum(axis=1)),
        float(np.log(len(scene.types))),
        float(np.log(len(scene.rooms))),
        *(float(np.log1p(n)) for n in of_kind),
        *((kinds == k).astype(np.float64) for k in ROOM_KINDS),
        np.log(opinions.usual[is_open] + 0.05),
        np.log(in_room @ opinions.usual + 0.05),
        float(np.log(opinions.usual.sum() + 0.05)),
        np.log1p(opinions.stood[is_open]),
    ]


def _top_m2(scene: ObservedScene) -> Floats:
    """The top-view area in square metres, with a small minimum."""
    return np.maximum(scene.size_m[:, 0] * scene.size_m[:, 1], 0.01)


def _clip(p: Floats) -> Floats:
    return np.clip(p, MIN_PROBABILITY, 1 - MIN_PROBABILITY)


def _logit(p: Floats) -> Floats:
    return np.log(p) - np.log1p(-p)
