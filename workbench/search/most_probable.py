"""The search policy MostProbable: the most probable container first, at any distance; a baseline that is worse than
Greedy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.search.find_costs import SearchStop
from workbench.search.orders import along
from workbench.search.places import places
from workbench.search.policy import SearchQuery


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class MostProbable:
    name: str = "most-probable"

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        """Order by decreasing probability; ties by distance from the origin, then in the plan's order."""
        here = places(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
        item = query.belief.item_types.index(query.item_type)
        order = np.lexsort((here.from_m[0], -here.probability[item]))
        return along(order, here, item=item, model="independent", costs=query.costs).stops
