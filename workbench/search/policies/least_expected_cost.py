"""The search policy of LIOS: the order with the least expected cost by Eq. 1, for a given belief model and
candidate limit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

from workbench.arrays import Floats
from workbench.search.candidates import PAPER_LIMIT, Ranking, check_limit
from workbench.search.engine import best_order, expected_search, first_stops
from workbench.search.find_costs import BeliefModel, SearchStop
from workbench.search.orders import ExpectedSearch
from workbench.search.places import search_space
from workbench.search.policy import SearchQuery
from workbench.worlds.house import ContainerId, ItemType


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LeastExpectedCost:
    """The optimal order by Eq. 1 over `limit` candidates.

    Raises:
        BadValue, TooManyCandidates: the limit is out of range.
    """

    name: str
    belief_model: BeliefModel
    ranking: Ranking
    limit: int = PAPER_LIMIT

    def __post_init__(self) -> None:
        check_limit(self.limit)

    def search(self, query: SearchQuery) -> ExpectedSearch:
        """The order with its expected cost."""
        return expected_search(query, belief_model=self.belief_model, limit=self.limit, ranking=self.ranking)

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        return self.search(query).stops

    def first(self, query: SearchQuery) -> ContainerId | None:
        here = search_space(query.belief, query.travel, origins=(query.origin,), targets=(query.target,))
        if not here.containers:
            return None
        order = best_order(
            here,
            query.belief.item_types.index(query.item_type),
            costs=query.costs,
            belief_model=self.belief_model,
            limit=self.limit,
            ranking=self.ranking,
        )
        return here.containers[order[0]]

    def firsts(self, query: SearchQuery, rows: Floats) -> frozenset[ContainerId]:
        """Where the policy looks first with each of many rows of probabilities in place of the query's.

        Args:
            rows: shape (any, containers of the query's belief).
        """
        types = tuple(ItemType(f"row {k}") for k in range(len(rows)))
        belief = replace(query.belief, item_types=types, probability=rows, p_detect=())
        here = search_space(belief, query.travel, origins=(query.origin,), targets=(query.target,))
        if not here.containers or not types:
            return frozenset()
        found = first_stops(
            here, costs=query.costs, belief_model=self.belief_model, limit=self.limit, ranking=self.ranking
        )
        return frozenset(here.containers[k] for k in found)
