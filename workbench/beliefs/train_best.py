"""How is the best estimator trained? Opinions out of fold, houses half searched, then boosted trees on their context.

The trees must learn how far names can be trusted in a house that the names' models have not seen. So the training
houses are dealt into folds, and each house's opinions come from counts and a network trained on the other folds.
Every house is then looked at several times: before anything is opened, and with a random share of its containers
seen. Sizes are taken exact where an asset table gives them and usual otherwise, so that either serves later.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from workbench.beliefs.best import Names, names_from
from workbench.beliefs.boosting import Boosting, Rows, boost
from workbench.beliefs.context import features
from workbench.beliefs.counts import counts_tensors
from workbench.beliefs.encoder import TextEncoder
from workbench.beliefs.examples import Examples, collect, house_weight, room_kinds
from workbench.beliefs.fcnn import FcnnEstimator
from workbench.beliefs.rates import rates_of
from workbench.beliefs.scene import scene_from
from workbench.beliefs.train_fcnn import Recipe, layers_of, train_fcnn
from workbench.beliefs.trees import trees_tensors
from workbench.beliefs.weights import Tensor
from workbench.worlds.house import House

Floats = npt.NDArray[np.float64]

FOLDS = 5
NETWORK = Recipe(epochs=80, memory=0.995)
"""The network of names inside: trained shorter than the paper's estimator, once for each fold and once for all."""

SINGLE_ROOM = 0.3
"""What a house of a single room counts for the trees."""

Watch = Callable[[str, int, float], None]
"""Told of what is being trained, its epoch or tree, and the held-out loss."""


def train_best(
    houses: Sequence[House],
    held_out: Sequence[House],
    encoder: TextEncoder,
    *,
    seed: int,
    single_room: float,
    usual_sizes: Sequence[House] | None = None,
    how: Boosting | None = None,
    network: Recipe = NETWORK,
    watch: Watch | None = None,
) -> tuple[Examples, dict[str, Tensor]]:
    """Train; returns the examples (whose names belong into the header) and the tensors.

    Args:
        houses, held_out: different houses.
        single_room: what a house of one room counts for the opinions.
        usual_sizes: the same training houses with usual sizes, when `houses` have exact ones.
    """
    rng = np.random.default_rng(seed)
    folds = _folds(houses)
    parts: list[_Part] = []
    others = houses if usual_sizes is None else usual_sizes
    for fold in range(FOLDS):
        train = [h for h, f in zip(houses, folds, strict=True) if f != fold]
        tested = [h for h, f in zip(houses, folds, strict=True) if f == fold]
        if not train or not tested:
            continue
        names, _ = _names(
            train, tested, encoder, seed, single_room, network, _tell(watch, f"names {fold + 1}/{FOLDS}")
        )
        for k, house in enumerate(houses):
            if folds[k] == fold:
                parts += _looks(house, others[k], names, rng)
    names, tensors = _names(houses, held_out, encoder, seed, single_room, network, _tell(watch, "names"))
    examples = collect(houses, weights=[house_weight(h, single_room=single_room) for h in houses])
    judged = [part for house in held_out for part in _looks(house, house, names, rng)]
    trees = boost(_rows(parts), _rows(judged), rng=rng, how=how or Boosting(), watch=_tell(watch, "trees"))
    tensors |= counts_tensors(examples, prefix="counts.") | trees_tensors(trees)
    tensors["usual"] = names.usual.astype(np.float32)
    tensors["rates"] = names.rates.probability.astype(np.float32)
    return examples, tensors


@dataclass(frozen=True, slots=True, kw_only=True)
class _Part:
    """One look at one house: features (features, items, open containers), what held, and the weight of a row."""

    features: Floats
    held: npt.NDArray[np.bool_]
    weight: float


def _folds(houses: Sequence[House]) -> list[int]:
    """Dealt in order, whole houses and single rooms apart, so that every fold has its share of both."""
    dealt = {True: 0, False: 0}
    folds: list[int] = []
    for house in houses:
        single = len(house.plan.rooms) == 1
        folds.append(dealt[single] % FOLDS)
        dealt[single] += 1
    return folds


def _names(
    houses: Sequence[House],
    held_out: Sequence[House],
    encoder: TextEncoder,
    seed: int,
    single_room: float,
    recipe: Recipe,
    watch: Callable[[int, float], None] | None,
) -> tuple[Names, dict[str, Tensor]]:
    examples = collect(houses, weights=[house_weight(h, single_room=single_room) for h in houses])
    tested = collect(held_out, weights=[house_weight(h, single_room=single_room) for h in held_out])
    network = train_fcnn(examples, tested, encoder, seed=seed, recipe=recipe, watch=watch)
    estimator = FcnnEstimator(name="fcnn", encoder=encoder, layers=layers_of(network))
    names = names_from(examples, estimator, rates_of(houses, examples), usual_types(houses, examples), encoder)
    return names, {f"network.{name}": value for name, value in network.items()}


def usual_types(houses: Sequence[House], examples: Examples) -> Floats:
    """How many types a container usually holds, shape (rooms + 1, containers + 1), smoothed towards its type."""
    shape = (len(examples.rooms) + 1, len(examples.containers) + 1)
    total, count = np.zeros(shape), np.zeros(shape)
    for house in houses:
        if len(house.plan.rooms) == 1 and any(len(h.plan.rooms) > 1 for h in houses):
            continue
        for container, kind in zip(house.plan.containers, room_kinds(house.plan), strict=True):
            at = (examples.rooms.index(kind), examples.containers.index(container.type))
            total[at] += len({item.type for item in house.contents[container.id]})
            count[at] += 1
    mean = (total.sum() + 1) / (count.sum() + 1)
    by_type = (total.sum(axis=0) + 3 * mean) / (count.sum(axis=0) + 3)
    return (total + 5 * by_type) / (count + 5)


def _looks(house: House, usual: House, names: Names, rng: np.random.Generator) -> list[_Part]:
    """Looks at a house: closed, with either sizes; and partly searched."""
    single = len(house.plan.rooms) == 1
    shares = [0.0, rng.uniform(0.05, 0.7)] if single else [0.0, 0.0, rng.uniform(0.05, 0.3), rng.uniform(0.2, 0.8)]
    parts: list[_Part] = []
    for k, share in enumerate(shares):
        seen_in = usual if (k == 1 and not single) or (k > 1 and rng.random() < 0.5) else house
        part = _look(seen_in, share, names, rng, weight=SINGLE_ROOM if single else 1.0)
        if part is not None:
            parts.append(part)
    return parts


def _look(house: House, share: float, names: Names, rng: np.random.Generator, *, weight: float) -> _Part | None:
    containers = house.plan.containers
    items = house.item_types()
    if not containers or not items:
        return None
    opened = np.zeros(len(containers), dtype=bool)
    opened[rng.permutation(len(containers))[: min(round(share * len(containers)), len(containers) - 1)]] = True
    held_in = [tuple(item.type for item in house.contents[c.id]) for c in containers]
    scene = scene_from(
        house.plan,
        is_open=[not o for o in opened],
        seen=tuple(held if o else None for held, o in zip(held_in, opened, strict=True)),
    )
    held = np.array([[item in inside for inside in held_in] for item in items], dtype=bool)[:, ~opened]
    return _Part(features=features(scene, items, names.opinions(scene, items)), held=held, weight=weight)


def _rows(parts: Sequence[_Part]) -> Rows:
    flat = [part.features.reshape(len(part.features), -1) for part in parts]
    queries: list[npt.NDArray[np.int64]] = []
    first = 0
    for part in parts:
        items, containers = part.held.shape
        queries.append(np.repeat(np.arange(first, first + items), containers))
        first += items
    table = np.concatenate(flat, axis=1)
    return Rows(
        features=table,
        start=table[0].copy(),
        held=np.concatenate([part.held.ravel() for part in parts]).astype(np.float64),
        weight=np.concatenate([np.full(part.held.size, part.weight) for part in parts]),
        query=np.concatenate(queries),
    )


def _tell(watch: Watch | None, what: str) -> Callable[[int, float], None] | None:
    if watch is None:
        return None
    return lambda number, loss: watch(what, number, loss)
