"""The estimator `people`: where people say that an object belongs, in whatever house.

The votes know 269 objects in 128 places (a receptacle in a kind of room). An object, a container's type and a room's
kind that the votes do not name take a weighted mean over the names that they do: weights fall with the angle between
sentence vectors, and become more even the less similar the closest name is; without a vector, all weights are equal.
How well a container fits is its share of votes; the chance that it holds an instance, given that the house has one,
is shared out among all containers of the house in proportion to how well they fit. Observations change nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arrays import Floats
from workbench.beliefs.belief import Belief
from workbench.beliefs.encoder import TextEncoder, generic_name, text_encoder
from workbench.beliefs.people.votes import Votes, votes_from
from workbench.beliefs.weights import Weights
from workbench.caches import PerObject
from workbench.errors import MissingExtra
from workbench.worlds.house import FloorPlan, ItemType
from workbench.worlds.knowledge import Knowledge

UNTIDY = 0.5
"""What a vote for "there when the house is untidy" counts, against one for "tidy"."""
SHARPNESS = 3.0
"""The power to which shares of votes are raised."""
INSTANCES = 1.4
"""Containers of a house that hold an item, on average, where the house has it."""
TEMPERATURE = 0.03
"""Names are weighted by exp(cosine / TEMPERATURE)."""
FLOOR = 0.02
"""The share of votes of a place that nobody named: things are also where they do not belong."""
DIGITS = 9
CACHE_SIZE = 20_000


@final
@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True)
class PeopleEstimator:
    """Votes with the encoder for other names.

    Attributes:
        name: "people@" and a hash.
    """

    name: str
    votes: Votes
    encoder: TextEncoder

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        """The belief over unsearched containers."""
        unsearched = knowledge.unsearched
        column = {c.id: j for j, c in enumerate(knowledge.plan.containers)}
        wanted = [column[c] for c in unsearched]
        rows = [self._house_row(knowledge.plan, item_type)[wanted] for item_type in item_types]
        probability = np.array(rows, dtype=np.float64).reshape(len(item_types), len(unsearched))
        return Belief(item_types=item_types, containers=unsearched, probability=probability, estimator=self.name)

    def _house_row(self, plan: FloorPlan, item_type: ItemType) -> Floats:
        """The chance of each container of a house to hold an item, shape (containers of the plan,)."""
        kind = {room.id: room.kind for room in plan.rooms}
        fits = np.array([self.fit(item_type, kind[c.room], c.type) for c in plan.containers])
        if not len(fits):
            return fits
        sharp = fits**SHARPNESS
        return np.round(1.0 - np.exp(-INSTANCES * sharp / sharp.sum()), DIGITS)

    def fit(self, item_type: str, room_kind: str, container_type: str) -> float:
        """How well an item fits into such a container in such a room: its share of votes, in (0, 1]."""
        cache = _FITS.of(self)
        key = item_type, room_kind, container_type
        found = cache.find(key)
        if found is None:
            found = self._fit(*key)
            cache.put(key, found)
        return found

    def _fit(self, item_type: str, room_kind: str, container_type: str) -> float:
        votes = self.votes
        places = self._weights(room_kind, votes.rooms) * self._weights(container_type, votes.receptacles)
        if not places.any():  # the votes know no such receptacle in this kind of room: take those in other rooms
            places = self._weights(container_type, votes.receptacles)
        per_object = (votes.tidy + UNTIDY * votes.untidy) @ (places / places.sum())
        return FLOOR + (1.0 - FLOOR) * float(per_object @ self._weights(item_type, votes.objects))

    def _weights(self, type_name: str, among: Sequence[str]) -> Floats:
        """How much each of the votes' names stands for a name, above 0, sums to 1, shape (among,).

        The less similar the closest name is, the more even the weights.
        """
        name = generic_name(type_name)
        same = np.array([other == name for other in among])
        if same.any():
            return same / same.sum()
        vector = self._vector(name)
        if vector is None:
            return np.full(len(among), 1.0 / len(among))
        index = {n: i for i, n in enumerate(self.votes.names)}
        cosine = self.votes.vectors[[index[n] for n in among]].astype(np.float64) @ vector
        close = np.exp((cosine - cosine.max()) / TEMPERATURE)
        alike = float(np.clip(cosine.max(), 0.0, 1.0))
        return alike * close / close.sum() + (1.0 - alike) / len(among)

    def _vector(self, name: str) -> Floats | None:
        if name in self.votes.names:
            return self.votes.vectors[self.votes.names.index(name)].astype(np.float64)
        try:
            return self.encoder.encode([name])[0].astype(np.float64)
        except MissingExtra:
            return None


_FITS: PerObject[tuple[str, str, str], float] = PerObject(CACHE_SIZE)
"""By item type, room kind and container type."""


def people_from(weights: Weights) -> PeopleEstimator:
    """The estimator of a weights file. Raises MalformedFile."""
    return PeopleEstimator(name=weights.name, votes=votes_from(weights), encoder=text_encoder(weights.header.encoder))
