"""The search policy Greedy, the paper's baseline: the nearest unsearched container first, then the one nearest to
it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.search.find_costs import SearchStop
from workbench.search.orders import order_cost
from workbench.search.places import SearchSpace, search_space
from workbench.search.policy import SearchQuery
from workbench.search.ties import first_least
from workbench.worlds.house import ContainerId, LocationId


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class NearestFirst:
    """The nearest unsearched container first; probabilities do not matter."""

    name: str = "greedy"

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        """Nearest neighbour from stop to stop; ties in the plan's order. Probabilities are taken as independent."""
        here = search_space(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
        item = query.belief.item_types.index(query.item_type)
        return order_cost(nearest_chain(here), here, item=item, model="independent", costs=query.costs).stops

    def first(self, query: SearchQuery) -> ContainerId | None:
        """The nearest container."""
        reachable = [c for c in query.belief.containers if query.travel.reaches(LocationId(c))]
        if not reachable:
            return None
        row = query.travel.metres[query.travel.index(query.origin)]
        at = [query.travel.index(LocationId(c)) for c in reachable]
        return reachable[first_least(row[at])]


def nearest_chain(here: SearchSpace) -> list[int]:
    """Indices of all containers, each the nearest to the one before."""
    order: list[int] = []
    left = np.ones(len(here.containers), dtype=bool)
    row = here.from_m[0]
    for _ in here.containers:
        nearest = first_least(np.where(left, row, np.inf))
        order.append(nearest)
        left[nearest] = False
        row = here.between_m[nearest]
    return order
