"""Latent kinds of item types with similar placements, and the rates at which containers hold each item type.

Most item types occur too rarely to estimate their places one by one, but there are few placement patterns: items
beside a washbasin, on a kitchen worktop, on any table. A kind is such a pattern: a rate for every room kind and
container type. Each item type belongs to one kind with some closeness: its finds are drawn from a
Dirichlet-multinomial around the kind (Minka, "Estimating a Dirichlet distribution", 2000), and the sentence vectors
of the names of a kind are close together. Kinds and memberships are fitted by expectation maximisation from several
seeded starts; the rates of the runs are averaged.

A frequent type keeps its own rates, a rare type is drawn to those of its kind, and an unknown type gets those of
the kinds nearest to its name.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.beliefs.examples import room_kinds
from workbench.beliefs.observed_scene import furniture_types
from workbench.worlds.house import House, RoomId

MIN_RATE, MAX_RATE = 1e-6, 0.9
"""Rates are clipped to [MIN_RATE, MAX_RATE]."""

UNSEEN_PSEUDO_COUNT = 0.5
"""Pseudo-count of a type without occurrences."""

DUPLICATE_PRIOR = 0.3
"""Prior probability that a room may hold a type twice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FitSettings:
    """Hyperparameters of the fit; the defaults were chosen by cross-validation over the training houses.

    Attributes:
        kinds: number of kinds.
        closeness: possible strengths of a kind's prior on a type, in pseudo-finds; each has a share of the types.
        names: weight of a squared distance between sentence vectors, in nats.
        doubt: strength of the overall rates as a prior on a kind, in pseudo-finds.
        unseen: pseudo-count of containers for combinations of room kind and type that were never seen.
        rounds: iterations of expectation maximisation; memberships are softened in the first half.
        runs: number of runs from different starts.
    """

    kinds: int = 8
    closeness: tuple[float, ...] = (5.0, 20.0, 80.0)
    names: float = 50.0
    doubt: float = 5.0
    unseen: float = 3.0
    rounds: int = 50
    runs: int = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacementCounts:
    """Counts of finds by place.

    Attributes:
        rooms, containers, items: names on the axes; the first two axes have an extra entry for unknown names.
        held: number of containers of a room kind and type that held an item type, shape (items, rooms + 1,
            containers
            + 1).
        stood: number of such containers in houses of sources that have the type at all, same shape. (The older
            ProcTHOR houses have no Objaverse items.)
    """

    rooms: tuple[str, ...]
    containers: tuple[str, ...]
    items: tuple[str, ...]
    held: Floats
    stood: Floats


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacementKinds:
    """One run's kinds.

    Attributes:
        rate: relative rates, shape (kinds, places); places are rooms x containers of the tally, flattened.
        centre: mean sentence vector of each kind's names, shape (kinds, dimensions).
        weight: share of the types by kind and closeness, shape (kinds, closenesses).
    """

    rate: Floats
    centre: Floats
    weight: Floats


def tally(houses: Sequence[House]) -> PlacementCounts:
    """Count finds over houses. The source of a house (the file that it came from) is its name up to the colon.

    An item type that stands in a room as furniture is not counted there: a plant on the floor says nothing about
    where plants are put.
    """
    rooms = tuple(sorted({room.kind for house in houses for room in house.plan.rooms}))
    containers = tuple(sorted({c.type for house in houses for c in house.plan.containers}))
    items = tuple(sorted({t for house in houses for t in house.item_types()}))
    room_at, container_at, item_at = ({n: k for k, n in enumerate(names)} for names in (rooms, containers, items))
    shape = (len(items), len(rooms) + 1, len(containers) + 1)
    held, stood = np.zeros(shape), np.zeros(shape)
    for several in by_source(houses).values():
        known = {item_at[t] for house in several for t in house.item_types()}
        for house in several:
            stands = _furniture_by_room(house, item_at)
            for container, kind in zip(house.plan.containers, room_kinds(house.plan), strict=True):
                r, c = room_at[kind], container_at[container.type]
                counted = known - stands[container.room]
                stood[sorted(counted), r, c] += 1
                held[sorted(counted & {item_at[i.type] for i in house.contents[container.id]}), r, c] += 1
    return PlacementCounts(rooms=rooms, containers=containers, items=items, held=held, stood=stood)


def _furniture_by_room(house: House, item_at: Mapping[str, int]) -> dict[RoomId, set[int]]:
    """For each room, the item types that stand in it as furniture."""
    types = furniture_types(house.plan)
    return {
        room.id: {item_at[t] for t in stands if t in item_at}
        for room, stands in zip(house.plan.rooms, types, strict=True)
    }


def by_source(houses: Sequence[House]) -> dict[str, list[House]]:
    """Houses by the file that they came from."""
    sources: dict[str, list[House]] = {}
    for house in houses:
        sources.setdefault(house.plan.name.partition(":")[0], []).append(house)
    return sources


def fit_kinds(
    found: PlacementCounts, vectors: Floats, *, rng: np.random.Generator, how: FitSettings
) -> PlacementKinds:
    """One run of the fit from a random start.

    Args:
        vectors: sentence vectors of the item types, shape (items, dimensions), of unit length.
    """
    data = _training_data(found, vectors, how)
    held, stood = data.held, data.stood
    count, often = min(how.kinds, len(held)), held.sum(axis=1)
    drawn = np.minimum(often, 20.0)
    starts = np.sort(rng.choice(len(held), count, replace=False, p=drawn / drawn.sum()))
    share = np.minimum(1.0, 20.0 / often[starts])[:, None]
    expected = stood[starts] * data.base
    exposed = stood[starts] * (share * often[starts, None] / expected.sum(axis=1, keepdims=True))
    kinds = PlacementKinds(
        rate=_rates(held[starts] * share, exposed, data, how),
        centre=(vectors[starts] + vectors.mean(axis=0)) / 2,
        weight=np.full((count, len(how.closeness)), 1.0 / count / len(how.closeness)),
    )
    for number in range(how.rounds):
        softness = min(1.0, 0.2 + number / (how.rounds / 2))
        kinds = _em_step(kinds, data, softness, how)
    return kinds


def rates_of(held: Floats, stood: Floats, vectors: Floats, kinds: PlacementKinds, how: FitSettings) -> Floats:
    """The rate at which a container holds an item type, independent of the house, by the kinds of one run.

    Args:
        held, stood: finds and containers, shape (items, places).
        vectors: of the names, shape (items, dimensions).

    Returns:
        Posterior means, shape (items, places).
    """
    scale = stood @ kinds.rate.T
    scale = np.where(scale > 0, scale, 1.0)
    member = _membership(kinds, held, stood, vectors, 1.0, how)
    often = held.sum(axis=1)
    own = np.divide(held, stood, out=np.zeros_like(held), where=stood > 0)
    rates = np.zeros_like(held)
    for k, close in enumerate(how.closeness):
        weight = member[:, :, k] / (often + close)[:, None]
        rates += weight.sum(axis=1, keepdims=True) * own + close * (weight / scale) @ kinds.rate
    return np.clip(np.maximum(often, UNSEEN_PSEUDO_COUNT)[:, None] * rates, MIN_RATE, MAX_RATE)


def duplicate_probability(rates: Floats, found: PlacementCounts, houses: Sequence[House]) -> Floats:
    """The probability that a room may hold each type twice, shape (items,).

    Some item types occur once per room: with a plate on the table there is none on the dresser, and with a plant on
    the floor there is none on the table. For each type, the number of rooms that had it twice is compared with the
    number expected if containers and furniture were independent.

    Args:
        rates: shape (items, rooms + 1, containers + 1).
    """
    item_at = {name: k for k, name in enumerate(found.items)}
    expected, twice = np.zeros(len(found.items)), np.zeros(len(found.items))
    for several in by_source(houses).values():
        known = sorted({item_at[t] for house in several for t in house.item_types()})
        for house in several:
            stands = _furniture_by_room(house, item_at)
            for room in house.plan.rooms:
                inside = [c for c in house.plan.containers if c.room == room.id]
                if not inside:
                    continue
                has = np.zeros(len(found.items))
                has[sorted(stands[room.id])] = 1
                types = [found.containers.index(c.type) for c in inside]
                expected[known] += _duplicate_probability(
                    rates[known][:, found.rooms.index(room.kind), types], has[known]
                )
                for container in inside:
                    has[sorted({item_at[i.type] for i in house.contents[container.id]})] += 1
                twice += has > 1
    rare = 0.02 * expected
    free = np.log(DUPLICATE_PRIOR) - expected + twice * np.log(np.maximum(expected, 1e-9))
    once = np.log1p(-DUPLICATE_PRIOR) - rare + twice * np.log(np.maximum(rare, 1e-9))
    return 1.0 / (1.0 + np.exp(np.clip(once - free, -30.0, 30.0)))


def _duplicate_probability(rates: Floats, has: Floats) -> Floats:
    """The probability that a room holds each type at least twice, shape (types,).

    Args:
        rates: rates of the room's containers, shape (types, containers).
        has: 1 if the type stands there as furniture, else 0.
    """
    none = np.prod(1 - rates, axis=1)
    return np.where(has > 0, 1 - none, 1 - none - none * (rates / (1 - rates)).sum(axis=1))


@dataclass(frozen=True, slots=True, kw_only=True)
class _TrainingData:
    """A tally prepared for fitting.

    Attributes:
        held, stood: finds and containers, shape (items, places).
        vectors: of the names, shape (items, dimensions).
        rooms: number of room kinds including the unknown one.
        base: rate at which a container of a place holds any item, shape (places,).
        prior: pseudo-count of containers, scaled so that its product with base sums to 1, shape (places,).
    """

    held: Floats
    stood: Floats
    vectors: Floats
    rooms: int
    base: Floats
    prior: Floats


def _training_data(found: PlacementCounts, vectors: Floats, how: FitSettings) -> _TrainingData:
    """A tally prepared for fitting; overall rates are smoothed towards those of the same container type."""
    held, stood = found.held.sum(axis=0), found.stood.sum(axis=0)
    types = len(found.items)
    mean = held.sum() / stood.sum()
    by_type = (held.sum(axis=0) + mean * 20 * types) / (stood.sum(axis=0) + 20 * types)
    base = ((held + by_type * how.unseen * types) / (stood + how.unseen * types)).ravel()
    prior = stood.ravel() / types + how.unseen
    base = base / (stood.ravel() / types * base).sum()
    return _TrainingData(
        held=found.held.reshape(types, -1),
        stood=found.stood.reshape(types, -1),
        vectors=vectors,
        rooms=len(found.rooms) + 1,
        base=base,
        prior=prior / (prior * base).sum(),
    )


def _rates(held: Floats, exposed: Floats, data: _TrainingData, how: FitSettings) -> Floats:
    """Relative rates of kinds from finds and exposures, shape (kinds, places).

    With little data, rates are drawn towards the overall rates times the kind's preference for the room.
    """
    shape = (len(held), data.rooms, -1)
    in_rooms = held.reshape(shape).sum(axis=2) + 1
    usual = (exposed * data.base).reshape(shape).sum(axis=2) + 1
    lifted = data.base * np.repeat(in_rooms / usual, held.shape[1] // data.rooms, axis=1)
    lifted = lifted / (lifted * data.prior).sum(axis=1, keepdims=True)
    rate = (held + how.doubt * data.prior * lifted) / (exposed + how.doubt * data.prior)
    return rate / (rate * data.stood.mean(axis=0)).sum(axis=1, keepdims=True)


def _membership(
    kinds: PlacementKinds, held: Floats, stood: Floats, vectors: Floats, softness: float, how: FitSettings
) -> Floats:
    """The posterior probability of each kind and closeness for each type, shape (items, kinds, closenesses)."""
    at, place = np.nonzero(held)
    finds, often = held[at, place], held.sum(axis=1)
    near = how.names * (vectors @ kinds.centre.T - (kinds.centre**2).sum(axis=1) / 2)
    score = near[:, :, None] + np.log(kinds.weight)
    for z, k, pseudo in _prior_strengths(kinds, stood, at, place, how):
        close = how.closeness[k]
        fit = np.bincount(at, _log_gamma(finds + pseudo) - _log_gamma(pseudo), minlength=len(held))
        score[:, z, k] += fit + _log_gamma(np.asarray(close)) - _log_gamma(often + close)
    score *= softness
    chance = np.exp(score - score.max(axis=(1, 2), keepdims=True))
    return chance / chance.sum(axis=(1, 2), keepdims=True)


def _prior_strengths(
    kinds: PlacementKinds, stood: Floats, at: Indices, place: Indices, how: FitSettings
) -> list[tuple[int, int, Floats]]:
    """The prior pseudo-finds of each kind and closeness at each find, shape (kinds, closenesses, finds)."""
    scale = stood @ kinds.rate.T
    pulls: list[tuple[int, int, Floats]] = []
    for z in range(len(kinds.rate)):
        share = stood[at, place] * kinds.rate[z, place] / scale[at, z]
        pulls += [(z, k, np.maximum(close * share, 1e-9)) for k, close in enumerate(how.closeness)]
    return pulls


def _em_step(kinds: PlacementKinds, data: _TrainingData, softness: float, how: FitSettings) -> PlacementKinds:
    """One iteration: memberships, then kinds. Repeated finds of a type count less than first ones, being its own
    habit."""
    held, stood, vectors = data.held, data.stood, data.vectors
    member = _membership(kinds, held, stood, vectors, softness, how)
    at, place = np.nonzero(held)
    finds, scale = held[at, place], stood @ kinds.rate.T
    found_of, by_type = np.zeros_like(kinds.rate), np.zeros((len(kinds.rate), len(held)))
    for z, k, pseudo in _prior_strengths(kinds, stood, at, place, how):
        counted = member[at, z, k] * pseudo * (_digamma(finds + pseudo) - _digamma(pseudo))
        found_of[z] += np.bincount(place, counted, minlength=held.shape[1])
        by_type[z] += np.bincount(at, counted, minlength=len(held))
    exposed = (by_type / np.maximum(scale.T, 1e-12)) @ stood
    whole = member.sum(axis=2)
    return PlacementKinds(
        rate=_rates(found_of, exposed, data, how),
        centre=(whole.T @ vectors + 2 * vectors.mean(axis=0)) / (whole.sum(axis=0)[:, None] + 2),
        weight=(member.sum(axis=0) + 0.5) / (len(held) + 0.5 * kinds.weight.size),
    )


def _log_gamma(x: Floats) -> Floats:
    """log(gamma(x)) for x > 0, shape as given: Stirling's series (Abramowitz and Stegun 6.1.41) at x + 10."""
    steps = x[..., None] + np.arange(10.0)
    y = x + 10.0
    series = 1 / (12 * y) - 1 / (360 * y**3) + 1 / (1260 * y**5) - 1 / (1680 * y**7) + 1 / (1188 * y**9)
    return (y - 0.5) * np.log(y) - y + np.log(2 * np.pi) / 2 + series - np.log(steps).sum(axis=-1)


def _digamma(x: Floats) -> Floats:
    """The derivative of _log_gamma, shape as given: its series (6.3.18) at x + 10."""
    steps = x[..., None] + np.arange(10.0)
    y = x + 10.0
    series = 1 / (12 * y**2) - 1 / (120 * y**4) + 1 / (252 * y**6) - 1 / (240 * y**8) + 1 / (132 * y**10)
    return np.log(y) - 1 / (2 * y) - series - (1 / steps).sum(axis=-1)
