"""A search policy that optimises Eq. 1 over all unsearched containers instead of a few candidates.

It is exact where a table over all containers is small. Otherwise it takes the exact order of the leading
candidates, then the others by the ratio of probability to distance, and improves this order by local search
(local_search.py). It is an anytime algorithm: after any number of passes there is a complete order with its expected
cost, and more passes never make it worse.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arrays import Floats, Indices, Ints
from workbench.errors import BadValue
from workbench.search.candidates import check_limit
from workbench.search.corrected import order_beyond
from workbench.search.engine import best_order
from workbench.search.find_costs import BeliefModel, SearchStop
from workbench.search.orders import ExpectedSearch, order_cost
from workbench.search.places import SearchSpace, search_space
from workbench.search.policy import SearchQuery
from workbench.search.remaining import unconditioned
from workbench.worlds.house import ContainerId

LEADING = 10
"""Number of containers whose initial order is exact; houses with no more are solved exactly."""

PASSES = 20
"""Most passes of local search; five are usually enough to converge."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class FullTour:
    """The policy over all unsearched containers.

    Attributes:
        leading: number of containers whose initial order is exact.
        passes: passes of local search; 0 keeps the initial order.

    Raises:
        BadValue, TooManyCandidates: `leading` or `passes` out of range.
    """

    name: str = "full-lios"
    belief_model: BeliefModel = "marginal"
    leading: int = LEADING
    passes: int = PASSES

    def __post_init__(self) -> None:
        check_limit(self.leading)
        if self.passes < 0:
            raise BadValue("passes", self.passes, "at least 0")

    def search(self, query: SearchQuery) -> ExpectedSearch:
        """The order over all containers with its expected cost."""
        here = search_space(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
        item = query.belief.item_types.index(query.item_type)
        return order_cost(self._order(here, item, query), here, item=item, model=self.belief_model, costs=query.costs)

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        return self.search(query).stops

    def first(self, query: SearchQuery) -> ContainerId | None:
        here = search_space(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
        order = self._order(here, query.belief.item_types.index(query.item_type), query)
        return here.containers[order[0]] if len(order) else None

    def _order(self, here: SearchSpace, item: int, query: SearchQuery) -> Indices:
        n = len(here.containers)
        if n == 0:
            return np.zeros(0, dtype=np.intp)
        lead = best_order(
            here, item, costs=query.costs, belief_model=self.belief_model, limit=self.leading, ranking="worth"
        )
        if len(lead) == n:
            return lead
        from workbench.search import local_search

        p = unconditioned(here.probability[item], self.belief_model)
        arrays = local_search.TourQuery(
            p=p,
            model=local_search.MODEL_NUMBERS[self.belief_model],
            from_m=here.from_m[0],
            between_m=here.between_m,
            found=query.costs.manipulation + here.to_m[:, 0],
            look=float(query.costs.search),
        )
        return local_search.improve(_with_tail(lead, p, here), arrays, self.passes)[0]


def _with_tail(lead: Indices, p: Floats, here: SearchSpace) -> Ints:
    """The leading order, then always the container of greatest probability against the distance from the last.

    Of equal ones (ties.py, by the greatest probability) the earlier.
    """
    rest = order_beyond(p[None], lead[None], here.between_m[lead[-1:]], here.between_m)[0]
    return np.concatenate([lead, rest]).astype(np.int64)
