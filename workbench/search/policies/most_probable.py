"""Look where the object is most likely, however far that is: a baseline that loses to Greedy (docs/search.md)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from workbench.search.find_costs import SearchStop
from workbench.search.orders import order_cost
from workbench.search.places import search_space
from workbench.search.policy import SearchQuery
from workbench.search.ties import ranked


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class MostProbable:
    """The most probable container first."""

    name: str = "most-probable"

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        """By falling probability; equal ones (ties.py) by distance from the origin, then in the plan's order."""
        here = search_space(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
        item = query.belief.item_types.index(query.item_type)
        nearest = ranked(-here.from_m[:1])[0]
        order = nearest[ranked(here.probability[item, nearest][None])[0]]
        return order_cost(order, here, item=item, model="independent", costs=query.costs).stops
