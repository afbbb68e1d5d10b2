"""The expected cost of a given search order, stop by stop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.arrays import Indices
from workbench.search.costs import ActionCosts
from workbench.search.find_costs import BeliefModel, SearchStop
from workbench.search.places import SearchSpace
from workbench.search.remaining import still_missing_along


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpectedSearch:
    """A search order and its expected cost under the belief.

    Attributes:
        stops: the order.
        partial_costs: contribution of each stop to the expected cost: the path there and the look, weighted by
            the probability that the search reaches it, plus the pick and the path to the target, weighted by the
            probability that it ends there.
        cost: their sum.
        missing: probability that the object is at none of the stops.
    """

    stops: tuple[SearchStop, ...]
    partial_costs: tuple[float, ...]
    cost: float
    missing: float


def order_cost(
    order: Sequence[int] | Indices,
    here: SearchSpace,
    *,
    item: int = 0,
    model: BeliefModel,
    costs: ActionCosts,
) -> ExpectedSearch:
    """The expected cost of an order of containers, for the first origin and the first target of `here`.

    Args:
        order: indices into here.containers.
        item: index of the item type.
    """
    indices = np.asarray(order, dtype=np.intp)
    missing = still_missing_along(here.probability[item : item + 1], indices[None], model)[0]
    legs = np.concatenate([here.from_m[0, indices[:1]], here.between_m[indices[:-1], indices[1:]]])
    ends = missing[:-1] - missing[1:]
    partial = missing[:-1] * (legs + costs.search) + ends * (costs.manipulation + here.to_m[indices, 0])
    found = np.divide(ends, missing[:-1], out=np.zeros_like(ends), where=missing[:-1] > 0)
    stops = tuple(
        SearchStop(container=here.containers[i], probability=float(p), reached=float(r), leg_m=float(leg))
        for i, p, r, leg in zip(indices, found, missing[:-1], legs, strict=True)
    )
    return ExpectedSearch(
        stops=stops,
        partial_costs=tuple(float(c) for c in partial),
        cost=float(partial.sum()),
        missing=float(missing[-1]),
    )
