"""Training of the estimator `best`: out-of-fold name opinions, partly searched houses, and boosted trees.

The trees must learn how far name-based rates can be trusted in a new house. So the training houses are split into
folds, and each house's opinions come from placements learnt on the other folds. Every house is then sampled several
times: before any search, and with a random share of its containers searched. Both exact sizes (from an asset table)
and usual sizes are used, so that the trees work with either.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.arrays import AnyArray, Bools, Floats, Ints
from workbench.beliefs.best import NameModel
from workbench.beliefs.boosted_trees.trees import trees_tensors
from workbench.beliefs.context import features
from workbench.beliefs.encoder import TextEncoder
from workbench.beliefs.observed_scene import scene_from
from workbench.beliefs.placements import Placements, placements_from, placements_tensors
from workbench.beliefs.training.boosting import Boosting, Rows, boost
from workbench.errors import Unsupported
from workbench.worlds.house import House

FOLDS = 5

SINGLE_ROOM = 0.3
"""Weight of a single-room house in training the trees."""

TrainingListener = Callable[[str, int, float], None]
"""Progress callback: what is being trained, its epoch or tree, and the held-out loss."""


def train_best(
    houses: Sequence[House],
    held_out: Sequence[House],
    encoder: TextEncoder,
    *,
    seed: int,
    usual_sizes: Sequence[House] | None = None,
    how: Boosting | None = None,
    watch: TrainingListener | None = None,
) -> tuple[Placements, dict[str, AnyArray]]:
    """Train the estimator; returns the placements (whose names go into the header) and the tensors.

    Args:
        houses, held_out: different houses.
        usual_sizes: the same training houses with usual sizes, when `houses` have exact ones.

    Raises:
        Unsupported: too few houses with items: every fold needs other houses to learn from, and some are held out.
    """
    rng = np.random.default_rng(seed)
    folds = _folds(houses)
    parts: list[_Sample] = []
    others = houses if usual_sizes is None else usual_sizes
    for fold in range(FOLDS):
        learnt = [h for h, f in zip(houses, folds, strict=True) if f != fold]
        if not any(h.item_types() for h in learnt):
            continue
        names = NameModel(placements=placements_from(learnt, encoder, seed=seed))
        for k, house in enumerate(houses):
            if folds[k] == fold:
                parts += _samples(house, others[k], names, rng)
    placements = placements_from(houses, encoder, seed=seed)
    names = NameModel(placements=placements)
    judged = [part for house in held_out for part in _samples(house, house, names, rng)]
    if not parts or not judged:
        raise Unsupported(
            f"best cannot be trained on {len(houses)} houses with {len(held_out)} held out: it needs at least two "
            "houses with items to learn from and one held out. Give more houses (--houses)."
        )
    trees = boost(
        _rows(parts), _rows(judged), rng=rng, how=how or Boosting(), watch=_progress_callback(watch, "trees")
    )
    return placements, placements_tensors(placements) | trees_tensors(trees)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sample:
    """One sample of one house: features (features, items, unsearched containers), labels, and the weight of a row."""

    features: Floats
    held: Bools
    weight: float


def _folds(houses: Sequence[House]) -> list[int]:
    """Folds assigned round-robin, for whole houses and single rooms separately, so that every fold has its share of
    both."""
    assigned = {True: 0, False: 0}
    folds: list[int] = []
    for house in houses:
        single = len(house.plan.rooms) == 1
        folds.append(assigned[single] % FOLDS)
        assigned[single] += 1
    return folds


def _samples(house: House, usual: House, names: NameModel, rng: np.random.Generator) -> list[_Sample]:
    """Samples of a house: unsearched, with either kind of sizes, and partly searched."""
    single = len(house.plan.rooms) == 1
    shares = [0.0, rng.uniform(0.05, 0.7)] if single else [0.0, 0.0, rng.uniform(0.05, 0.3), rng.uniform(0.2, 0.8)]
    parts: list[_Sample] = []
    for k, share in enumerate(shares):
        seen_in = usual if (k == 1 and not single) or (k > 1 and rng.random() < 0.5) else house
        part = _sample(seen_in, share, names, rng, weight=SINGLE_ROOM if single else 1.0)
        if part is not None:
            parts.append(part)
    return parts


def _sample(
    house: House, share: float, names: NameModel, rng: np.random.Generator, *, weight: float
) -> _Sample | None:
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
    return _Sample(features=features(scene, items, names.opinions(scene, items)), held=held, weight=weight)


def _rows(parts: Sequence[_Sample]) -> Rows:
    flat = [part.features.reshape(len(part.features), -1) for part in parts]
    queries: list[Ints] = []
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


def _progress_callback(watch: TrainingListener | None, what: str) -> Callable[[int, float], None] | None:
    if watch is None:
        return None
    return lambda number, loss: watch(what, number, loss)
