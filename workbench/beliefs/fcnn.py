"""The paper's estimator (Sec. IV-D): a fully connected network over the embeddings of room, container and item.

The input is the three sentence vectors, each followed by a one-hot vector that says which of the three it is. The
first layer is linear in the three, so each name passes it once; the rest runs once for each triple of names and is
cached. Only the forward pass, in numpy: torch is needed for training alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arrays import Floats
from workbench.beliefs.belief import Belief
from workbench.beliefs.encoder import TextEncoder, text_encoder, vectors_of
from workbench.beliefs.weights import Weights
from workbench.caches import PerObject
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge

ROLES = ("room", "container", "item")
"""The order of the three in the input, and their one-hot kinds."""

Triple = tuple[str, str, str]
"""Room kind, container type, item type."""
FIRST_LAYER_CACHE_SIZE = 20_000
CACHE_SIZE = 200_000
"""Number of cached triples; beyond it, the cache is emptied."""

DIGITS = 9
"""Probabilities are rounded to so many decimals, since matrix products round differently with the batch size."""

Layer = tuple[Floats, Floats]
"""Weights, shape (out, in), and bias, shape (out,)."""


@final
@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True)
class FcnnEstimator:
    """The network with its encoder.

    Attributes:
        name: "fcnn@" and a hash.
        encoder: the text encoder.
        layers: first to last; all but the last are followed by a ReLU.
    """

    name: str
    encoder: TextEncoder
    layers: tuple[Layer, ...]

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        """The belief over unsearched containers.

        Raises:
            NameNotShipped: a name cannot be encoded.
        """
        unsearched = knowledge.unsearched
        kind = {room.id: room.kind for room in knowledge.plan.rooms}
        container = {c.id: c for c in knowledge.plan.containers}
        places = [(kind[container[c].room], container[c].type) for c in unsearched]
        probability = self.probabilities(places, item_types)
        return Belief(item_types=item_types, containers=unsearched, probability=probability, estimator=self.name)

    def probabilities(self, places: Sequence[tuple[str, str]], items: Sequence[str]) -> Floats:
        """P(held), shape (items, places), of (room kind, container type) places."""
        distinct = sorted(set(places))
        known = self._probabilities_of([(r, c, i) for r, c in distinct for i in sorted(set(items))])
        at = {place: k for k, place in enumerate(distinct)}
        table = np.array([[known[r, c, i] for r, c in distinct] for i in items], dtype=np.float64)
        return table.reshape(len(items), len(distinct))[:, [at[place] for place in places]]

    def _probabilities_of(self, triples: Sequence[Triple]) -> dict[Triple, float]:
        """The network's answers; those to triples that are remembered are not computed again."""
        cache = _ANSWERS.of(self)
        found = {triple: answer for triple in triples if (answer := cache.find(triple)) is not None}
        wanted = [triple for triple in triples if triple not in found]
        if wanted:
            answers = self._run(wanted)
            found.update(answers)
            for triple, answer in answers.items():
                cache.put(triple, answer)
        return found

    def _run(self, triples: Sequence[Triple]) -> dict[Triple, float]:
        columns = [self._first_layer(role, [t[k] for t in triples]) for k, role in enumerate(ROLES)]
        hidden = columns[0] + columns[1] + columns[2] + self.layers[0][1]
        for weight, bias in self.layers[1:]:
            hidden = np.maximum(hidden, 0.0) @ weight.T + bias
        probability = np.round(1.0 / (1.0 + np.exp(-np.clip(hidden[:, 0], -30.0, 30.0))), DIGITS)
        return dict(zip(triples, probability.tolist(), strict=True))

    def _first_layer(self, role: str, names: Sequence[str]) -> Floats:
        """The contribution of each name in a role to the first layer, shape (names, hidden)."""
        cache = _FIRST_LAYERS.of(self)
        rows = {n: row for n in names if (row := cache.find((role, n))) is not None}
        strange = sorted({n for n in names if n not in rows})
        if strange:
            width = self.layers[0][0].shape[1] // len(ROLES)
            k = ROLES.index(role)
            block = self.layers[0][0][:, k * width : (k + 1) * width]
            one_hot = np.tile(np.eye(len(ROLES))[k], (len(strange), 1))
            inputs = np.concatenate([vectors_of(self.encoder, strange).astype(np.float64), one_hot], axis=1)
            for n, row in zip(strange, inputs @ block.T, strict=True):
                rows[n] = row
                cache.put((role, n), row)
        return np.array([rows[n] for n in names])


_ANSWERS: PerObject[Triple, float] = PerObject(CACHE_SIZE)
_FIRST_LAYERS: PerObject[tuple[str, str], Floats] = PerObject(FIRST_LAYER_CACHE_SIZE)
"""By role and name."""


def fcnn_from(weights: Weights) -> FcnnEstimator:
    """The estimator of a weights file. Raises MalformedFile."""
    encoder = text_encoder(weights.header.encoder)
    return FcnnEstimator(name=weights.name, encoder=encoder, layers=layers_from(weights, encoder))


def layers_from(weights: Weights, encoder: TextEncoder) -> tuple[Layer, ...]:
    """The layers of a weights file, checked against the encoder's vectors. Raises MalformedFile."""
    return weights.layers("", len(ROLES) * (vectors_of(encoder, ["Mug"]).shape[1] + len(ROLES)))
