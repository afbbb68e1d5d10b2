"""All beliefs of the estimator `best` that other items in partly known containers can lead to.

Such items change four features only (`context.py`): how full the searched containers of the house, of a room and of a
type are, and how alike the most alike item of a room is. The trees distinguish few values of each.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from math import prod
from typing import NamedTuple

import numpy as np

from workbench.arrays import Bools, Floats, Ints
from workbench.beliefs.boosted_trees.trees import Trees
from workbench.beliefs.context import ALIKE, FEATURES, FULL_HOUSE, FULL_ROOM, FULL_TYPE
from workbench.beliefs.fcnn import DIGITS
from workbench.beliefs.observed_scene import ObservedScene

MAX_COUNTS = 20_000
"""Limit on combinations of numbers of other items that are looked through; with many searched containers they
multiply."""
ROWS_AT_ONCE = 4096
"""Beliefs about one item that are computed together, which saves calls and takes some megabytes."""
SLACK = 1e-6
"""Numbers of items are computed from logarithms; this much more or less than what is possible is still tried."""


def probability_of(logit: Floats) -> Floats:
    """The probabilities of log-odds, rounded."""
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


def tables_whatever_else(
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
        return [probability_of(table[0] + trees.total(table.reshape(FEATURES, -1)).reshape(table.shape[1:]))]
    types = np.unique(np.array(scene.types), return_inverse=True)[1]
    places = np.unique(np.stack([scene.room, types], axis=1)[partly_known], axis=0)
    rooms = np.intersect1d(places[:, 0], scene.room[scene.open])
    fullness = list(_fullness(trees, table, scene, usual, types, places))
    together = _together(fullness, [places[:, 0] == one for one in rooms])
    if together is None or len(together) > at_most:
        return None
    room, items = scene.room[scene.open], range(table.shape[1])
    shared = [each.rises for each in fullness]
    alike = [[_rises(ALIKE, room == one, trees, table[:, k]) for one in rooms] for k in items]
    found: dict[bytes, Floats] = {}
    at_once = max(1, ROWS_AT_ONCE // max(prod(map(len, of)) for of in alike))
    for first in range(0, len(together), at_once):
        some = together[first : first + at_once]
        by_item: list[list[list[Floats]]] = []
        for k in items:
            levels = _with_alike(some, alike[k], at_most)
            if levels is None:
                return None
            by_item.append(_distinct_rows(trees, table[:, k], shared + alike[k], levels))
        for rows in zip(*by_item, strict=True):
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


def _together(fullness: Sequence[_Fullness], in_rooms: Sequence[Bools]) -> list[tuple[int, ...]] | None:
    """Which values of fullness occur together, and in which rooms there are other items then; None where there are
    too many numbers of other items.

    Args:
        in_rooms: for each room, which places are in it, shape (places,).

    Returns:
        For each fullness, which of its rises; for each room, 1 if there are other items.
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
    least = np.stack([each.least[n] for each, n in zip(passed, numbers.T, strict=True)], axis=1)
    most = np.stack([each.most[n] for each, n in zip(passed, numbers.T, strict=True)], axis=1)
    for low, high in zip(least.tolist(), most.tolist(), strict=True):
        which = [low] if low == high else product(*map(range, low, [k + 1 for k in high]))
        found.update(dict.fromkeys(map(tuple, which)))
    return list(found)


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
    _, first, which = np.unique(least * (len(takes) + 1) + most, return_index=True, return_inverse=True)
    return _Passed(least, most, first[which])


def _with_alike(
    together: Sequence[tuple[int, ...]], alike: Sequence[Sequence[_Rise]], at_most: int
) -> list[list[tuple[int, ...]]] | None:
    """To each combination of _together, all that may be most alike in the rooms with other items.

    Args:
        alike: the rises of each room.

    Returns:
        For each combination, which rise of each fullness and of each room; None where one has more than at_most.
    """
    made: list[list[tuple[int, ...]]] = []
    for chosen in together:
        fullness = chosen[: len(chosen) - len(alike)]
        others = chosen[len(fullness) :]
        choices = [range(len(rises) if other else 1) for rises, other in zip(alike, others, strict=True)]
        if prod(map(len, choices)) > at_most:
            return None
        made.append([fullness + most_alike for most_alike in product(*choices)])
    return made


def _distinct_rows(
    trees: Trees, known: Floats, groups: Sequence[Sequence[_Rise]], levels: Sequence[Sequence[tuple[int, ...]]]
) -> list[list[Floats]]:
    """The distinct probabilities of one item in the open containers, for each of several sets of rises.

    Args:
        groups: the values that features can take in some open containers.
        levels: of each set, which values of the groups occur together.
    """
    together = np.array([each for of in levels for each in of], dtype=np.int64)
    rows = np.split(_rows(trees, known, groups, together), np.cumsum([len(of) for of in levels])[:-1])
    return [list({row.tobytes(): row for row in of}.values()) for of in rows]


def _rows(trees: Trees, known: Floats, groups: Sequence[Sequence[_Rise]], levels: Ints) -> Floats:
    """The probabilities of one item in the open containers, shape (rows, open containers).

    A container has few values of its own features, which many rows share: each is evaluated once.

    Args:
        levels: which value of each group, shape (rows, groups).
    """
    containers = known.shape[1]
    codes = np.zeros((len(levels), containers), dtype=np.int64)
    for rises, level in zip(groups, levels.T, strict=True):
        these = rises[0].these
        codes[:, these] = codes[:, these] * len(rises) + level[:, None]
    codes = codes * containers + np.arange(containers)
    _, first, which = np.unique(codes, return_index=True, return_inverse=True)
    row, container = np.divmod(first, containers)
    columns = known[:, container]
    for rises, level in zip(groups, levels.T, strict=True):
        at = rises[0].feature, np.flatnonzero(rises[0].these[container])
        value = np.array([rise.value for rise in rises])[level[row[at[1]]]]
        columns[at] = np.maximum(columns[at], value)
    return probability_of(columns[0] + trees.total(columns))[which].reshape(codes.shape)
