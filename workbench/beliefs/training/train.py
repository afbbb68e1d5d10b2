"""The table of trainers, and the writing of weights files with their headers."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from workbench.arrays import AnyArray
from workbench.beliefs.counts import counts_settings, counts_tensors
from workbench.beliefs.encoder import TextEncoder
from workbench.beliefs.examples import collect, house_weight
from workbench.beliefs.placements import placements_settings
from workbench.beliefs.weights import VERSION, Header, Weights, write_weights
from workbench.errors import BadValue, MissingExtra, UnknownName
from workbench.worlds.house import House

SINGLE_ROOM = 0.1
"""Weight of a single-room house, chosen by log loss on validation houses."""

TrainingListener = Callable[[str, int, float], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingSet:
    """The training set and settings of an estimator.

    Attributes:
        houses, held_out: disjoint sets of houses; the held-out ones decide when training stops.
        encoder: the text encoder.
        seed: the same seed trains the same weights.
        usual_sizes: the training houses with usual sizes, if `houses` have exact ones; else None.
        single_room: weight of a single-room house.
    """

    houses: Sequence[House]
    held_out: Sequence[House]
    encoder: TextEncoder
    seed: int = 0
    usual_sizes: Sequence[House] | None = None
    single_room: float = SINGLE_ROOM

    def __post_init__(self) -> None:
        if not self.houses or not self.held_out:
            counts = (len(self.houses), len(self.held_out))
            raise BadValue("houses to learn from and to hold out", counts, "at least one of each")
        if self.usual_sizes is not None and len(self.usual_sizes) != len(self.houses):
            raise BadValue("houses with usual sizes", len(self.usual_sizes), "as many as houses to learn from")

    def weights(self, houses: Sequence[House]) -> list[float]:
        """The weight of each house; all 1 if every house has a single room."""
        if all(len(h.plan.rooms) == 1 for h in self.houses):
            return [1.0] * len(houses)
        return [house_weight(h, single_room=self.single_room) for h in houses]


TrainingResult = tuple[dict[str, Any], dict[str, AnyArray]]
"""Settings for the header, and tensors."""

Trainer = Callable[[TrainingSet, TrainingListener | None], TrainingResult]


def train(name: str, training_set: TrainingSet, path: Path, *, watch: TrainingListener | None = None) -> Weights:
    """Train an estimator and write its weights.

    Raises:
        UnknownName: no trainer of that name.
        BadValue: no houses, or houses without items.
        MissingExtra: a network is to be trained and torch is not installed.
    """
    if name not in TRAINERS:
        raise UnknownName("estimator to train", name, TRAINERS)
    losses: dict[str, float] = {}

    def report(what: str, number: int, loss: float) -> None:
        losses[what] = min(losses.get(what, loss), loss)
        if watch:
            watch(what, number, loss)

    settings, tensors = TRAINERS[name](training_set, report)
    header = Header(
        estimator=name,
        version=VERSION,
        encoder="" if name == "counts" else training_set.encoder.name,
        houses_sha256=houses_sha256(training_set.houses),
        houses=len(training_set.houses),
        seed=training_set.seed,
        metrics={f"held-out loss of {what}": round(loss, 6) for what, loss in sorted(losses.items())},
        settings=settings,
    )
    return write_weights(path, header, tensors)


def houses_sha256(houses: Sequence[House]) -> str:
    """A hash of the training houses: their names, rooms, containers and contents."""
    digest = hashlib.sha256()
    for house in houses:
        digest.update(repr((house.plan.name, [(r.id, r.kind) for r in house.plan.rooms])).encode())
        for c in house.plan.containers:
            digest.update(repr((c.type, c.room, c.size_m, [i.type for i in house.contents[c.id]])).encode())
    return digest.hexdigest()


def hold_out(houses: Sequence[House], *, share: float, rng: np.random.Generator) -> tuple[list[House], list[House]]:
    """Split houses at random into training and held-out houses, at least one of each.

    Raises:
        BadValue: fewer than two houses.
    """
    if len(houses) < 2:
        raise BadValue("houses to train on", len(houses), "at least 2, one of them to hold out")
    count = min(max(1, round(share * len(houses))), len(houses) - 1)
    out = set(rng.permutation(len(houses))[:count].tolist())
    return [h for k, h in enumerate(houses) if k not in out], [h for k, h in enumerate(houses) if k in out]


def _train_counts(training_set: TrainingSet, watch: TrainingListener | None) -> TrainingResult:
    del watch
    examples = collect(training_set.houses, weights=training_set.weights(training_set.houses))
    return counts_settings(examples), counts_tensors(examples)


def _train_fcnn(training_set: TrainingSet, watch: TrainingListener | None) -> TrainingResult:
    _require_torch()
    from workbench.beliefs.training.fcnn import train_fcnn

    examples = collect(training_set.houses, weights=training_set.weights(training_set.houses))
    held_out = collect(training_set.held_out, weights=training_set.weights(training_set.held_out))

    def report(epoch: int, loss: float) -> None:
        if watch:
            watch("network", epoch, loss)

    tensors = train_fcnn(examples, held_out, training_set.encoder, seed=training_set.seed, watch=report)
    return {"names": len(examples.items)}, tensors


def _train_best(training_set: TrainingSet, watch: TrainingListener | None) -> TrainingResult:
    from workbench.beliefs.training.best import train_best

    placements, tensors = train_best(
        training_set.houses,
        training_set.held_out,
        training_set.encoder,
        seed=training_set.seed,
        usual_sizes=training_set.usual_sizes,
        watch=watch,
    )
    return {**placements_settings(placements)}, tensors


def _require_torch() -> None:
    if find_spec("torch") is None:
        raise MissingExtra("training a network", "train")


TRAINERS: Mapping[str, Trainer] = MappingProxyType(
    {"counts": _train_counts, "fcnn": _train_fcnn, "best": _train_best}
)
"""How each estimator is trained."""
