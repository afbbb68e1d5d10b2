"""Caches of the searches over one log, each computed once and shared by all strategies.

Thousands of branches differ in what was found and where it was brought, yet request the same search: the same item
type, from the same place to the same place, among the same containers with the same probabilities. A policy's answer
depends on its query alone, so that caching changes no result.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import final

from replayers.counterfactual.bounds.lower_bound import LowerBound
from replayers.counterfactual.bounds.state_bounds import StateBounds
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.relevance import Relevance
from replayers.counterfactual.strategy_traits import SearchTraits
from workbench.beliefs.belief import Belief
from workbench.caches import Cache
from workbench.planning.find_pricing import FindCostRequest, FindPricing
from workbench.search.find_costs import FindCosts, SearchStop
from workbench.search.policy import SearchPolicy, SearchQuery, first_stop
from workbench.worlds.house import ContainerId, ItemType, LocationId

MAX_CACHED_SEARCHES = 10_000
"""Searches of each kind in the cache."""
MAX_CACHED_BOUNDS = 16

Order = tuple[SearchStop, ...]


@final
@dataclass(slots=True)
class SearchCache:
    """The cache of searches over one log: its travel costs are the same for every query."""

    orders: Cache[Hashable, Order] = field(default_factory=lambda: Cache(MAX_CACHED_SEARCHES))
    firsts: Cache[Hashable, ContainerId | None] = field(default_factory=lambda: Cache(MAX_CACHED_SEARCHES))
    prices: Cache[Hashable, FindCosts] = field(default_factory=lambda: Cache(MAX_CACHED_SEARCHES))
    lowers: Cache[Hashable, LowerBound] = field(default_factory=lambda: Cache(MAX_CACHED_BOUNDS))
    outsides: Cache[Hashable, StateBounds] = field(default_factory=lambda: Cache(MAX_CACHED_BOUNDS))
    relevances: Cache[tuple[ItemType, ...], Relevance] = field(default_factory=lambda: Cache(MAX_CACHED_BOUNDS))

    def outside(self, evidence: Evidence, relevance: Relevance, traits: SearchTraits) -> StateBounds:
        """The outer bounds over the log, cached for every kind of strategy."""

        def made() -> StateBounds:
            least = self.lowers.get(relevance.types, lambda: LowerBound(evidence, relevance))
            return StateBounds(evidence, relevance, traits, least)

        return self.outsides.get((relevance.types, traits), made)


@final
@dataclass(frozen=True, slots=True)
class CachedPolicy:
    """A policy that computes each search once."""

    policy: SearchPolicy
    cache: SearchCache

    @property
    def name(self) -> str:
        return self.policy.name

    def order(self, query: SearchQuery) -> Order:
        return self.cache.orders.get(self._key(query), lambda: self.policy.order(query))

    def first(self, query: SearchQuery) -> ContainerId | None:
        """Where the policy looks first."""
        return self.cache.firsts.get(self._key(query), lambda: first_stop(self.policy, query))

    def _key(self, query: SearchQuery) -> Hashable:
        belief = query.belief
        chances = belief.of(query.item_type).tobytes()
        return (self.policy, query.item_type, query.origin, query.target, belief.containers, chances, query.costs)


@final
@dataclass(frozen=True, slots=True)
class CachedPricing:
    """A find cost that computes each table once."""

    pricing: FindPricing
    cache: SearchCache

    def price(self, request: FindCostRequest) -> FindCosts:
        belief = request.belief
        about = (belief.item_types, belief.containers, belief.probability.tobytes(), belief.estimator)
        key = (self.pricing, about, tuple(request.origins), tuple(request.targets), request.costs)
        return self.cache.prices.get(key, lambda: self.pricing.price(request))

    def meeting_places(self, belief: Belief) -> tuple[LocationId, ...]:
        return self.pricing.meeting_places(belief)
