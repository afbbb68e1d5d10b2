"""Beliefs: for each item type, the probability of finding it in each unsearched container."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from workbench.arrays import Floats
from workbench.caches import PerObject
from workbench.errors import BadValue
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.knowledge import Knowledge


@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True)
class Belief:
    """Probabilities with their axes.

    Attributes:
        item_types: axis 0.
        containers: axis 1, unsearched containers in the plan's order.
        probability: float64, shape (item types, containers), within [0, 1], read-only. Entry (o, c) is the
            probability that at least one instance of o is in c; rows need not add up to 1.
        estimator: the estimator with a short hash of its weights: "fcnn@1a2b3c4d".
        p_detect: per item type, the chance that one look detects it where it is, in (0, 1]; empty for certain.

    Raises:
        BadValue: the shape does not match the axes, or an entry is not a probability.
    """

    item_types: tuple[ItemType, ...]
    containers: tuple[ContainerId, ...]
    probability: Floats
    estimator: str
    p_detect: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        p = _numbers(self.probability)
        shape = (len(self.item_types), len(self.containers))
        if p.shape != shape:
            raise BadValue("belief", p.shape, f"of shape {shape} (item types, containers)")
        if self.p_detect and len(self.p_detect) != len(self.item_types):
            raise BadValue("detection probabilities", len(self.p_detect), f"{len(self.item_types)}, one an item type")
        for detected in self.p_detect:
            if not 0 < detected <= 1:  # also true for nan
                raise BadValue("a detection probability", detected, "above 0 and at most 1")
        if p.size and not (p.min() >= 0 and p.max() <= 1):  # also true for nan
            o, c = np.argwhere(~((p >= 0) & (p <= 1)))[0]
            named = f"the probability of {self.item_types[o]} in {self.containers[c]}"
            raise BadValue(named, float(p[o, c]), "within [0, 1]")
        p.flags.writeable = False
        object.__setattr__(self, "probability", p)

    def of(self, item_type: ItemType) -> Floats:
        """The row of an item type, shape (containers,).

        Raises:
            ValueError: the item type is not in the belief.
        """
        return self.probability[self.item_types.index(item_type)]

    def only(self, item_types: tuple[ItemType, ...]) -> Belief:
        """The belief restricted to some types, in the given order; types that it lacks get probability 0."""
        if item_types == self.item_types:
            return self
        return _ONLY.of(self).get(item_types, lambda: self._restricted(item_types))

    def _restricted(self, item_types: tuple[ItemType, ...]) -> Belief:
        rows = [self.of(t) if t in self.item_types else np.zeros(len(self.containers)) for t in item_types]
        probability = np.array(rows).reshape(len(item_types), len(self.containers))
        return replace(
            self,
            item_types=item_types,
            probability=probability,
            p_detect=tuple(self.detects(t) for t in item_types) if self.p_detect else (),
        )

    def detects(self, item_type: ItemType) -> float:
        """The chance that one look detects an item of that type where it is."""
        certain = not self.p_detect or item_type not in self.item_types
        return 1.0 if certain else self.p_detect[self.item_types.index(item_type)]


def _numbers(given: object) -> Floats:
    """A copy as float64; text, complex numbers and objects are refused instead of converted."""
    p = np.array(given)
    if p.dtype.kind not in "fiub":
        raise BadValue("the type of the belief's probabilities", p.dtype.name, "a number's, such as float64")
    return p.astype(np.float64, copy=False)


_ONLY: PerObject[tuple[ItemType, ...], Belief] = PerObject(64)
"""Restrictions of beliefs, each made once."""


class Estimator(Protocol):
    """Turns the robot's knowledge into a belief. Deterministic: the same knowledge gives the same belief."""

    @property
    def name(self) -> str:
        """The name with a short hash of the weights: "fcnn@1a2b3c4d"."""
        ...

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        """The belief over knowledge.unsearched, given everything observed so far."""
        ...
