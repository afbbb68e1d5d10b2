"""The estimator `mixed`: people's votes and what was learned from houses, averaged (a linear opinion pool).

A pool is never far off where either of the two is right: its log loss exceeds that of the better one by no more than
the logarithm of one over its share.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.beliefs.belief import Belief, Estimator
from workbench.beliefs.best import best_from
from workbench.beliefs.people.people import people_from
from workbench.beliefs.weights import Weights, read_weights
from workbench.errors import BadValue
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Knowledge

PEOPLE_SHARE = 0.25
"""What the votes weigh; the rest is the learned estimator's."""
DIGITS = 12


@final
@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True)
class MixedEstimator:
    """Two estimators and the weight of the first.

    Raises:
        BadValue: a share outside [0, 1].
    """

    people: Estimator
    learned: Estimator
    people_share: float = PEOPLE_SHARE

    def __post_init__(self) -> None:
        if not 0 <= self.people_share <= 1:
            raise BadValue("share of people's votes", self.people_share, "within [0, 1]")

    @property
    def name(self) -> str:
        """ "mixed@" and a hash of both names and the share."""
        parts = repr((self.people.name, self.learned.name, self.people_share))
        return f"mixed@{hashlib.sha256(parts.encode()).hexdigest()[:8]}"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        """The belief over unsearched containers: the weighted mean of both."""
        votes, learned = (e.believe(knowledge, item_types) for e in (self.people, self.learned))
        share = self.people_share
        probability = np.round(share * votes.probability + (1.0 - share) * learned.probability, DIGITS)
        return Belief(
            item_types=item_types, containers=learned.containers, probability=probability, estimator=self.name
        )


def mixed_from(votes: Weights) -> MixedEstimator:
    """The mixture of the votes in a weights file of `people` and the shipped estimator `best`.

    Raises:
        MalformedFile: the file holds no votes.
    """
    best = votes.path.parent / "best.safetensors"
    return MixedEstimator(people=people_from(votes), learned=best_from(read_weights(best, estimator="best")))
