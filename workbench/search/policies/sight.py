"""The search policy that plans for what is seen in passing: the way of least expected cost, counting what it shows.

Where nothing is seen in passing, it is conditioned-lios.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.arrays import Indices
from workbench.search.candidates import PAPER_LIMIT, Ranking, check_limit, choose
from workbench.search.find_costs import BeliefModel, SearchStop
from workbench.search.in_passing.program import SightLegs, first_costs
from workbench.search.orders import order_cost
from workbench.search.places import SearchSpace, search_space
from workbench.search.policies.least_expected_cost import LeastExpectedCost
from workbench.search.policy import SearchQuery
from workbench.search.remaining import still_missing_by_subset
from workbench.search.ties import first_least
from workbench.worlds.house import ContainerId, LocationId
from workbench.worlds.travel import Sight


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class SightAware:
    """The policy; travel costs say what comes into view on which path (TravelCosts.sight).

    Raises:
        BadValue, TooManyCandidates: the limit is out of range.
    """

    name: str = "sight-lios"
    belief_model: BeliefModel = "exists"
    ranking: Ranking = "worth"
    limit: int = PAPER_LIMIT

    def __post_init__(self) -> None:
        check_limit(self.limit)

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        """Where the robot goes as long as it finds nothing: the first by the plan, then the others as
        conditioned-lios orders them."""
        first = self.first(query)
        stops = self._without_sight.order(query)
        if first is None or stops[0].container == first:
            return stops
        here = _space(query)
        rest = [here.containers.index(s.container) for s in stops if s.container != first]
        item = query.belief.item_types.index(query.item_type)
        order = [here.containers.index(first), *rest]
        return order_cost(order, here, item=item, model=self.belief_model, costs=query.costs).stops

    def first(self, query: SearchQuery) -> ContainerId | None:
        here, sight = _space(query), query.travel.sight
        if sight is None or not here.containers:
            return self._without_sight.first(query)
        item = query.belief.item_types.index(query.item_type)
        row = here.probability[item : item + 1]
        chosen = choose(row, here.from_m[0], here.to_m[:, 0], limit=self.limit, ranking=self.ranking)
        costs = first_costs(
            still_missing_by_subset(row, chosen, self.belief_model)[0],
            _legs(here, chosen[0], query, sight),
            query.costs.manipulation + here.to_m[chosen[0], 0],
            query.costs.search,
        )
        return here.containers[chosen[0, first_least(costs)]]

    @property
    def _without_sight(self) -> LeastExpectedCost:
        return LeastExpectedCost(
            name=self.name, belief_model=self.belief_model, ranking=self.ranking, limit=self.limit
        )


def _space(query: SearchQuery) -> SearchSpace:
    return search_space(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))


def _legs(here: SearchSpace, chosen: Indices, query: SearchQuery, sight: Sight) -> SightLegs:
    k = len(chosen)
    names = [here.containers[c] for c in chosen]
    place = {name: c for c, name in enumerate(names)}
    metres = np.concatenate([here.between_m[np.ix_(chosen, chosen)], here.from_m[:1, chosen]])
    seen, until_m = np.full((k + 1, k, k), -1), metres.copy()
    along_m, on_m = np.zeros((k + 1, k, k)), np.zeros((k + 1, k, k))
    onward_m, at = np.zeros((k + 1, k, k)), query.travel.rows(tuple(names))
    for i, start in enumerate((*names, query.origin)):
        for a, end in enumerate(names):
            if i == a:
                continue
            views = [view for view in sight.coming_into_view(start, LocationId(end)) if view[0] in place]
            for n, (container, before_m, after_m) in enumerate(views):
                c = place[container]
                seen[i, a, n], along_m[i, a, n], on_m[i, a, n] = c, min(before_m, metres[i, a]), after_m
                if c == a:
                    until_m[i, a] = along_m[i, a, n]
            row = sight.metres_from_view(start, LocationId(end)) if until_m[i, a] < metres[i, a] else None
            onward_m[i, a] = metres[a] if row is None else row[at]
    return SightLegs(metres=metres, seen=seen, along_m=along_m, on_m=on_m, until_m=until_m, onward_m=onward_m)
