"""The search policy where looks can miss: the sequence of looks, some of them repeated, of least expected cost.

Where a look detects for certain, it is conditioned-lios.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.search.find_costs import SearchStop
from workbench.search.orders import ExpectedSearch, order_cost
from workbench.search.policy import SearchQuery
from workbench.search.repeated_looks.missing import still_missing_along_looks
from workbench.search.repeated_looks.table import TWO_LOOKS, LookModel, looks_of_query
from workbench.worlds.house import ContainerId


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Robust:
    """The policy; the belief says how surely a look detects (Belief.p_detect).

    Attributes:
        looks_again: it may choose at every decision to look again into a container.
    """

    name: str = "robust-lios"
    model: LookModel = TWO_LOOKS
    looks_again: bool = True

    def search(self, query: SearchQuery) -> ExpectedSearch:
        """All looks of the plan with their expected cost; a container is a stop as often as it is looked into."""
        here, item, order = looks_of_query(query, self.model)
        if not len(order):
            return ExpectedSearch(stops=(), partial_costs=(), cost=0.0, missing=1.0)
        detect = query.belief.detects(query.item_type)
        if detect == 1.0:
            return order_cost(order, here, item=item, model=self.model.belief_model, costs=query.costs)
        miss = np.full(len(here.containers), 1.0 - detect)
        missing = still_missing_along_looks(here.probability[item], order, miss, self.model.belief_model)
        legs = np.concatenate([here.from_m[0, order[:1]], here.between_m[order[:-1], order[1:]]])
        ends = missing[:-1] - missing[1:]
        found = query.costs.manipulation + here.to_m[order, 0]
        partial = missing[:-1] * (legs + query.costs.search) + ends * found
        share = np.divide(ends, missing[:-1], out=np.zeros_like(ends), where=missing[:-1] > 0)
        return ExpectedSearch(
            stops=tuple(
                SearchStop(container=here.containers[a], probability=float(p), reached=float(r), leg_m=float(leg))
                for a, p, r, leg in zip(order, share, missing[:-1], legs, strict=True)
            ),
            partial_costs=tuple(float(c) for c in partial),
            cost=float(partial.sum()),
            missing=float(missing[-1]),
        )

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        """The containers in the order of their first looks."""
        first: dict[ContainerId, SearchStop] = {}
        for stop in self.search(query).stops:
            first.setdefault(stop.container, stop)
        return tuple(first.values())

    def first(self, query: SearchQuery) -> ContainerId | None:
        here, _, order = looks_of_query(query, self.model)
        return here.containers[order[0]] if len(order) else None
