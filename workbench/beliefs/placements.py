"""The probability of each container to hold an item that the house is known to have, from placement rates.

A rate (`placement_mixture.py`) says how often a kind of container holds an item type, independent of the house.
Containers of a house are taken as independent; for an item that a room has once, the containers of the room are
rivals: each is willing to hold it by its rate, and one of the willing, drawn at random, has it. The result is
conditioned on some container of the house having the item. Containers searched without success are no longer
rivals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.polynomial.legendre import leggauss

from workbench.arrays import AnyArray, Floats, Ints
from workbench.beliefs.encoder import TextEncoder, text_encoder, vectors_of
from workbench.beliefs.placement_mixture import (
    MAX_RATE,
    MIN_RATE,
    FitSettings,
    PlacementCounts,
    PlacementKinds,
    duplicate_probability,
    fit_kinds,
    rates_of,
    tally,
)
from workbench.beliefs.weights import Weights
from workbench.caches import PerObject
from workbench.errors import MalformedFile
from workbench.tolerances import NEAR_PROBABILITY
from workbench.worlds.house import House

_RULE = leggauss(6)
NODES, NODE_WEIGHTS = (_RULE[0] + 1) / 2, _RULE[1] / 2
"""Gauss-Legendre quadrature on [0, 1], exact for rooms of up to twelve containers."""

UNKNOWN_DUPLICATE_PROBABILITY = 0.15
"""The probability that a room may hold an unknown type twice."""

SEVERAL, HELD, STOOD, USUAL, RATES = "several", "often", "stood", "usual", "rates"


@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True)
class Placements:
    """Placement statistics of item types by name.

    Attributes:
        rooms, containers, items: names on the axes; rooms and containers have an extra entry for unknown names.
        rates: rate at which a container holds an item type, shape (items, rooms + 1, containers + 1).
        several: probability that a room may hold a type in two containers, shape (items,).
        often: number of occurrences of each type, shape (items,).
        stood: number of containers of each kind, shape (rooms + 1, containers + 1).
        usual: usual number of types in one of them, same shape.
        kinds: kinds of all runs, for unknown types.
        encoder: of their names.
    """

    rooms: tuple[str, ...]
    containers: tuple[str, ...]
    items: tuple[str, ...]
    rates: Floats
    several: Floats
    often: Floats
    stood: Floats
    usual: Floats
    kinds: tuple[PlacementKinds, ...]
    encoder: TextEncoder
    how: FitSettings = field(default_factory=FitSettings)
    _item_at: Mapping[str, int] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_item_at", {name: k for k, name in enumerate(self.items)})

    def places(self, kinds: Sequence[str], types: Sequence[str]) -> tuple[list[int], list[int]]:
        """Place indices of containers, given by room kind and container type."""
        return _indices(self.rooms, kinds), _indices(self.containers, types)

    def rates_at(self, kinds: Sequence[str], types: Sequence[str], items: Sequence[str]) -> Floats:
        """Rates of items in containers, shape (items, containers).

        Raises:
            NameNotShipped: an unknown name cannot be encoded.
        """
        rooms, containers = self.places(kinds, types)
        table = np.array([self._of(name) for name in items]).reshape(len(items), *self.stood.shape)
        return table[:, rooms, containers]

    def duplicate_probabilities(self, items: Sequence[str]) -> Floats:
        """Probabilities that a room may hold each type twice, shape (items,)."""
        return np.array(
            [self.several[self._item_at[i]] if i in self._item_at else UNKNOWN_DUPLICATE_PROBABILITY for i in items]
        )

    def occurrences(self, items: Sequence[str]) -> Floats:
        """Number of occurrences of each type, shape (items,)."""
        return np.array([self.often[self._item_at[i]] if i in self._item_at else 0.0 for i in items])

    def _of(self, name: str) -> Floats:
        """Rates of one type in every kind of place, shape (rooms + 1, containers + 1)."""
        if name in self._item_at:
            return self.rates[self._item_at[name]]
        return _UNKNOWN.of(self).get(name, lambda: self._of_unknown(name))

    def _of_unknown(self, name: str) -> Floats:
        """Rates of a type that was in no training house, by its name alone."""
        vector = vectors_of(self.encoder, [name]).astype(np.float64)
        stood = self.stood.reshape(1, -1)
        runs = [rates_of(np.zeros_like(stood), stood, vector, kinds, self.how) for kinds in self.kinds]
        return np.mean(runs, axis=0).reshape(self.stood.shape)


_UNKNOWN: PerObject[str, Floats] = PerObject(2_000)
"""Rates of types that were in no training house."""


def placements_from(
    houses: Sequence[House], encoder: TextEncoder, *, seed: int, how: FitSettings | None = None
) -> Placements:
    """Learn placements from houses.

    Raises:
        NameNotShipped: a name that the encoder cannot encode.
    """
    how = how or FitSettings()
    found = tally(houses)
    vectors = vectors_of(encoder, found.items).astype(np.float64)
    runs = [fit_kinds(found, vectors, rng=np.random.default_rng((seed, run)), how=how) for run in range(how.runs)]
    kinds = tuple(_rounded_kinds(run) for run in runs)
    held, stood = (values.reshape(len(values), -1) for values in (found.held, found.stood))
    rates = np.mean([rates_of(held, stood, vectors, run, how) for run in kinds], axis=0)
    rates = _rounded(rates.reshape(found.held.shape))
    return Placements(
        rooms=found.rooms,
        containers=found.containers,
        items=found.items,
        rates=rates,
        several=_rounded(duplicate_probability(rates, found, houses)),
        often=held.sum(axis=1),
        stood=found.stood.max(axis=0),
        usual=_rounded(usual_types(houses, found)),
        kinds=kinds,
        encoder=encoder,
        how=how,
    )


def condition_on_existence(rates: Floats, several: Floats, room: Ints) -> Floats:
    """The probability of each container to hold an item type, given that one of them does.

    Args:
        rates: shape (items, containers), below 1.
        several: probability that containers of a room are not rivals, shape (items,).
        room: of each container, shape (containers,).

    Returns:
        Shape (items, containers).
    """
    if not rates.size:
        return rates
    anywhere = -np.expm1(np.log1p(-rates).sum(axis=1, keepdims=True))
    free = several[:, None]
    return (free * rates + (1 - free) * share_among_rivals_numpy(rates, room)) / anywhere


def exclude_furniture_rooms(
    rates: Floats, several: Floats, items: Sequence[str], room: Ints, stands: Sequence[Sequence[str]]
) -> Floats:
    """Rates adjusted for rooms that have an item type as furniture: an item that a room has once is then not in its
    containers.

    Args:
        rates: shape (items, containers).
        several: probability that a room may have a type twice, shape (items,).
        room: of each container, an index into stands.
        stands: for each room, the types of its furniture.
    """
    there = np.array([[name in types for types in stands] for name in items], dtype=bool)
    there = there.reshape(len(items), len(stands))[:, room]
    return np.where(there, np.maximum(rates * several[:, None], MIN_RATE), rates)


def share_among_rivals_numpy(rates: Floats, room: Ints) -> Floats:
    """The probability of each container to hold an item that its room has once, shape (items, containers).

    One of the willing containers is drawn: rate times E[1 / (1 + willing rivals)], which is the integral over x in
    [0, 1] of the product over the rivals of (1 - rate + rate x).
    """
    from workbench.beliefs.compiled_rivals import share_among_rivals

    return share_among_rivals(np.ascontiguousarray(rates), np.ascontiguousarray(room), NODES, NODE_WEIGHTS)


def usual_types(houses: Sequence[House], found: PlacementCounts) -> Floats:
    """The usual number of types in a container, shape (rooms + 1, containers + 1), smoothed towards its container
    type."""
    shape = found.held.shape[1:]
    total, count = np.zeros(shape), np.zeros(shape)
    for house in houses:
        if len(house.plan.rooms) == 1 and any(len(h.plan.rooms) > 1 for h in houses):
            continue
        kind = {room.id: room.kind for room in house.plan.rooms}
        for container in house.plan.containers:
            at = (found.rooms.index(kind[container.room]), found.containers.index(container.type))
            total[at] += len({item.type for item in house.contents[container.id]})
            count[at] += 1
    mean = (total.sum() + 1) / (count.sum() + 1)
    by_type = (total.sum(axis=0) + 3 * mean) / (count.sum(axis=0) + 3)
    return (total + 5 * by_type) / (count + 5)


def placements_tensors(placements: Placements) -> dict[str, AnyArray]:
    """The tensors of a weights file."""
    kinds = placements.kinds
    return {
        RATES: placements.rates.astype(np.float32),
        SEVERAL: placements.several.astype(np.float32),
        HELD: placements.often.astype(np.float32),
        STOOD: placements.stood.astype(np.float32),
        USUAL: placements.usual.astype(np.float32),
        "kinds.rate": np.stack([k.rate for k in kinds]).astype(np.float32),
        "kinds.centre": np.stack([k.centre for k in kinds]).astype(np.float16),
        "kinds.weight": np.stack([k.weight for k in kinds]).astype(np.float32),
    }


def placements_settings(placements: Placements) -> dict[str, list[str]]:
    """The names of the axes, for the header of a weights file."""
    return {
        "rooms": [*placements.rooms],
        "containers": [*placements.containers],
        "items": [*placements.items],
    }


def placements_of(weights: Weights) -> Placements:
    """The placements in a weights file. Raises MalformedFile."""
    rooms, containers, items = (weights.names(axis) for axis in ("rooms", "containers", "items"))
    encoder, how = text_encoder(weights.header.encoder), FitSettings()
    shape = (len(rooms) + 1, len(containers) + 1)
    dimensions = vectors_of(encoder, ["Mug"]).shape[1]
    rate = weights.tensor("kinds.rate", None, None, shape[0] * shape[1]).astype(np.float64)
    runs, kinds = rate.shape[:2]
    centre = weights.tensor("kinds.centre", runs, kinds, dimensions).astype(np.float64)
    weight = weights.tensor("kinds.weight", runs, kinds, len(how.closeness)).astype(np.float64)
    rates = weights.tensor(RATES, len(items), *shape).astype(np.float64)
    several, often = (weights.tensor(name, len(items)).astype(np.float64) for name in (SEVERAL, HELD))
    stood, usual = (weights.tensor(name, *shape).astype(np.float64) for name in (STOOD, USUAL))
    chances = (
        (rates <= 0).any()
        or (rates > MAX_RATE + NEAR_PROBABILITY).any()
        or (several < 0).any()
        or (several > 1).any()
    )
    if chances or (rate <= 0).any() or (weight <= 0).any() or min(often.min(), stood.min(), usual.min()) < 0:
        raise MalformedFile(weights.path, "impossible counts or rates", "Train it again with lios train")
    return Placements(
        rooms=rooms,
        containers=containers,
        items=items,
        rates=rates,
        several=several,
        often=often,
        stood=stood,
        usual=usual,
        kinds=tuple(PlacementKinds(rate=rate[k], centre=centre[k], weight=weight[k]) for k in range(runs)),
        encoder=encoder,
        how=how,
    )


def _rounded_kinds(kinds: PlacementKinds) -> PlacementKinds:
    """Kinds rounded to the precision of a weights file, so that trained and loaded ones agree."""
    centre = kinds.centre.astype(np.float16).astype(np.float64)
    return PlacementKinds(rate=_rounded(kinds.rate), centre=centre, weight=_rounded(kinds.weight))


def _rounded(values: Floats) -> Floats:
    return values.astype(np.float32).astype(np.float64)


def _indices(names: tuple[str, ...], wanted: Sequence[str]) -> list[int]:
    at = {name: k for k, name in enumerate(names)}
    return [at.get(name, len(names)) for name in wanted]
