"""Tables of find costs: the cost of finding each item type from each origin to each target."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from workbench.arrays import Floats
from workbench.errors import BadValue
from workbench.worlds.house import ContainerId, ItemType, LocationId

BeliefModel = Literal["independent", "exists", "exclusive", "marginal"]
"""The meaning of P(a) after other containers turned out empty (remaining.py; docs/search.md)."""

FindCostKind = Literal["optimistic", "pessimistic", "model"]


@dataclass(frozen=True, slots=True, kw_only=True)
class FindCosts:
    """Costs with their axes.

    Attributes:
        item_types: axis 0.
        origins: axis 1, where a find starts.
        targets: axis 2, where it ends with the item in hand.
        metres: float64, shape (item types, origins, targets), read-only, at least 0, in cost units
            (metres and their equivalents).
        kind: optimistic, pessimistic or model.
        belief_model: for kind "model", what P(a) means.
    """

    item_types: tuple[ItemType, ...]
    origins: tuple[LocationId, ...]
    targets: tuple[LocationId, ...]
    metres: Floats
    kind: FindCostKind
    belief_model: BeliefModel = "independent"

    def __post_init__(self) -> None:
        metres = np.array(self.metres, dtype=np.float64)
        shape = (len(self.item_types), len(self.origins), len(self.targets))
        if metres.shape != shape:
            raise BadValue("find costs", metres.shape, f"of shape {shape} (item types, origins, targets)")
        if metres.size and not (metres.min() >= 0 and metres.max() < np.inf):  # also true for nan
            raise BadValue("find costs", "a negative or non-finite entry", "finite and at least 0")
        metres.flags.writeable = False
        object.__setattr__(self, "metres", metres)

    def of(self, item_type: ItemType, origin: LocationId, target: LocationId) -> float:
        """One cost in cost units.

        Raises:
            ValueError: a label is not on its axis.
        """
        return float(
            self.metres[self.item_types.index(item_type), self.origins.index(origin), self.targets.index(target)]
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchStop:
    """One container in a search order.

    Attributes:
        container: the container to look into.
        probability: probability that the object is found here, given that it was not found at earlier stops.
        reached: probability that the search reaches this stop.
        leg_m: distance in metres from the previous stop (or the origin).
    """

    container: ContainerId
    probability: float
    reached: float
    leg_m: float
