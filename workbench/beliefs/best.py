"""What is the best that this project believes? Names, and around them what names do not say.

Three opinions from names (the smoothed counts, the paper's network, and rates that hold in any house) and the
features of `context.py` go through boosted trees, which correct the opinions' mean in log-odds. It updates by
evidence: what was seen and what was looked for in vain are features, learnt on houses half searched.

Training is in `train_best.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import final

import numpy as np
import numpy.typing as npt

from workbench.beliefs.belief import Belief
from workbench.beliefs.context import FEATURES, Opinions, features, seen_types
from workbench.beliefs.counts import CountsTable, examples_from, smooth, table_of, tallies
from workbench.beliefs.encoder import NameNotShipped, TextEncoder, text_encoder, vectors_of
from workbench.beliefs.examples import Examples
from workbench.beliefs.fcnn import DIGITS, FcnnEstimator, layers_from
from workbench.beliefs.scene import Scene, scene_of
from workbench.beliefs.trees import Trees, trees_from
from workbench.beliefs.weights import Weights
from workbench.errors import MalformedFile
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.names import usual_size_m

Floats = npt.NDArray[np.float64]

MOST_FORMED = 256
"""Houses and items whose opinions are kept."""

_Asked = tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]
"""Kinds of rooms and types of containers, a container each, and item types."""

RATE_OF_UNKNOWN = 0.06
"""How often a container holds an item of which nothing is known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Names:
    """What names say: how opinions are formed.

    Attributes:
        table: the smoothed counts.
        network: the paper's network.
        rates: how often containers of a kind hold an item in any house.
        seen: how many examples there were, shape (rooms + 1, containers + 1, items + 1) of the table's axes.
        in_room: how often any container of such a room holds an item, of the same shape.
        rate, often: per item of the table, how often a container holds it, and how often it was met.
        usual: how many types a container holds, shape (rooms + 1, containers + 1) of the table's axes.
        encoder: for how alike two names are.
    """

    table: CountsTable
    network: FcnnEstimator
    rates: CountsTable
    seen: CountsTable
    in_room: CountsTable
    rate: dict[str, float]
    often: dict[str, float]
    usual: Floats
    encoder: TextEncoder
    _vectors: dict[str, npt.NDArray[np.float32] | None] = field(
        default_factory=dict[str, "npt.NDArray[np.float32] | None"], repr=False
    )
    _formed: dict[_Asked, Opinions] = field(default_factory=dict["_Asked", Opinions], repr=False)

    def opinions(self, scene: Scene, items: tuple[str, ...]) -> Opinions:
        """What names say of items in all containers of a scene; only the likeness changes from look to look."""
        asked = (scene.kinds, scene.types, items)
        if asked not in self._formed:
            if len(self._formed) >= MOST_FORMED:
                self._formed.clear()
            self._formed[asked] = self._form(scene, items)
        return replace(self._formed[asked], likeness=self._likeness(items, seen_types(scene)))

    def _form(self, scene: Scene, items: tuple[str, ...]) -> Opinions:
        places = list(zip(scene.kinds, scene.types, strict=True))
        return Opinions(
            counts=self.table.look_up(scene.kinds, scene.types, items),
            network=self.network.probabilities(places, items),
            rates=self.rates.look_up(scene.kinds, scene.types, items),
            seen=self.seen.look_up(scene.kinds, scene.types, items),
            in_room=self.in_room.look_up(scene.kinds, scene.types, items),
            size_m=np.array([usual_size_m(i) for i in items]).reshape(-1, 3),
            rate=np.array([self.rate.get(i, RATE_OF_UNKNOWN) for i in items]),
            often=np.array([self.often.get(i, 0.0) for i in items]),
            usual=self.table.of_pairs(self.usual, scene.kinds, scene.types),
            likeness=np.zeros((len(items), 0)),
        )

    def _likeness(self, items: Sequence[str], types: Sequence[str]) -> Floats:
        """Cosines, shape (items, types); 0 for a seen type that nothing here can encode."""
        if not types:
            return np.zeros((len(items), 0))
        found = [self._vector(t) for t in types]
        zero = np.zeros_like(vectors_of(self.encoder, items[:1])[0])
        seen = np.array([zero if v is None else v for v in found], dtype=np.float64)
        asked = np.array([zero if v is None else v for v in map(self._vector, items)], dtype=np.float64)
        return np.round(asked @ seen.T, DIGITS)

    def _vector(self, name: str) -> npt.NDArray[np.float32] | None:
        if name not in self._vectors:
            try:
                self._vectors[name] = vectors_of(self.encoder, [name])[0]
            except NameNotShipped:
                self._vectors[name] = None
        return self._vectors[name]


def names_from(
    examples: Examples, network: FcnnEstimator, rates: Floats, usual: Floats, encoder: TextEncoder
) -> Names:
    """Opinions of examples, a network trained on them, and rates on their axes."""
    count = len(examples.items)
    held = np.bincount(examples.triples[:, 2], examples.held, minlength=count)
    seen = np.bincount(examples.triples[:, 2], examples.seen, minlength=count)
    rate = (held + 10 * RATE_OF_UNKNOWN) / (seen + 10)
    seen_at, held_at = tallies(examples)
    expected = np.append(rate, RATE_OF_UNKNOWN)
    in_room = (held_at.sum(axis=1) + 5 * expected) / (seen_at.sum(axis=1) + 5)
    return Names(
        table=smooth(examples),
        network=network,
        rates=table_of(rates, examples),
        seen=table_of(seen_at, examples),
        in_room=table_of(np.broadcast_to(in_room[:, None], seen_at.shape), examples),
        rate=dict(zip(examples.items, rate.tolist(), strict=True)),
        often=dict(zip(examples.items, held.tolist(), strict=True)),
        usual=usual,
        encoder=encoder,
    )


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class BestEstimator:
    """Names and context."""

    name: str
    names: Names
    trees: Trees

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        """Raises NameNotShipped for an item name that nothing here can encode."""
        scene = scene_of(knowledge)
        shape = (len(item_types), int(scene.open.sum()))
        probability = np.zeros(shape)
        if probability.size:
            table = features(scene, item_types, self.names.opinions(scene, item_types))
            logit = table[0] + self.trees.total(table.reshape(FEATURES, -1)).reshape(shape)
            probability = np.round(1.0 / (1.0 + np.exp(-np.clip(logit, -30.0, 30.0))), DIGITS)
        return Belief(
            item_types=item_types, containers=knowledge.unsearched, probability=probability, estimator=self.name
        )


def best_from(weights: Weights) -> BestEstimator:
    """The estimator of a weights file. Raises MalformedFile."""
    encoder = text_encoder(weights.header.encoder)
    examples = examples_from(weights, prefix="counts.")
    network = FcnnEstimator(
        name=weights.name, encoder=encoder, layers=layers_from(weights, encoder, prefix="network.")
    )
    axes = [len(names) + 1 for names in (examples.rooms, examples.containers, examples.items)]
    usual = weights.tensor("usual", *axes[:2]).astype(np.float64)
    rates = weights.tensor("rates", *axes).astype(np.float64)
    if (usual < 0).any() or (rates <= 0).any() or (rates >= 1).any():
        raise MalformedFile(weights.path, "counts or rates that cannot be", "Train it again with lios train")
    return BestEstimator(
        name=weights.name,
        names=names_from(examples, network, rates, usual, encoder),
        trees=trees_from(weights, features=FEATURES),
    )
