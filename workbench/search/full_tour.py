"""Eq. 1 over every unsearched container, not over a few candidates. (First version: the largest exact table.)"""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

from workbench.search.engine import expected_search
from workbench.search.find_costs import BeliefModel, SearchStop
from workbench.search.orders import ExpectedSearch
from workbench.search.policy import SearchQuery


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class FullTour:
    name: str = "full-lios"
    belief_model: BeliefModel = "exists"

    def search(self, query: SearchQuery) -> ExpectedSearch:
        return expected_search(query, belief_model=self.belief_model, limit=8, ranking="worth")

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        return self.search(query).stops
