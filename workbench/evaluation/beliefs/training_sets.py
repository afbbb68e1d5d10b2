"""Training sets from house files: shared files by their split, others by holding out a share."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from workbench.beliefs.encoder import text_encoder
from workbench.beliefs.training.train import TrainingSet, hold_out
from workbench.evaluation.splits import Split, is_shared, split_indices
from workbench.worlds.house import House
from workbench.worlds.procthor.assets import assets_for
from workbench.worlds.procthor.load import load_houses


def training_set_of(
    files: Sequence[Path], *, assets: Path | None, encoder: str, seed: int, share: float
) -> TrainingSet:
    """The training set of several house files.

    Args:
        files: house files; shared ones are split by index, and of the others a share is held out.
        assets: a table of exact sizes, None for the one beside a file; with a table, houses are also included
            with usual sizes.
        encoder: a text encoder's name.
        share: share to hold out of a file without splits.

    Raises:
        InputError: a file cannot be read, or there are too few houses.
    """
    rng = np.random.default_rng(seed)
    learnt: list[House] = []
    usual: list[House] = []
    out: list[House] = []
    exact = False
    for path in files:
        table = assets_for(path, assets)
        houses = load_houses(path, assets=table)
        train, held = _parts(path, houses, share, rng)
        learnt += train
        out += held
        named = {h.plan.name: h for h in load_houses(path)} if table else {}
        usual += [named.get(h.plan.name, h) for h in train]
        exact = exact or table is not None
    return TrainingSet(
        houses=learnt,
        held_out=out,
        encoder=text_encoder(encoder),
        seed=seed,
        usual_sizes=usual if exact else None,
    )


def names_in(files: Sequence[Path]) -> tuple[str, ...]:
    """All names in house files as spelled there, sorted: rooms, containers, other furniture, items.

    Raises:
        InputError: a file cannot be read.
    """
    names: set[str] = set()
    for path in files:
        for house in load_houses(path):
            plan = house.plan
            names.update(room.kind for room in plan.rooms)
            names.update(thing.type for thing in (*plan.containers, *plan.furniture))
            names.update(house.item_types())
    return tuple(sorted(names))


def _parts(
    path: Path, houses: list[House], share: float, rng: np.random.Generator
) -> tuple[list[House], list[House]]:
    if not is_shared(path):
        return hold_out(houses, share=share, rng=rng)
    chosen = (split_indices(path, part, houses=len(houses)) for part in (Split.TRAIN, Split.VALIDATION))
    train, held = ([houses[k] for k in indices] for indices in chosen)
    return train, held
