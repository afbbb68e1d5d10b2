"""Built-in strategies without explanations: the same steps, computed faster.

The thousands of branches of a replay need neither the alternatives nor the search order beyond its first stop, which
is all that the loop executes. They also ask for the same searches repeatedly, so that search results are cached.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

from replayers.counterfactual.bounds.search_cache import CachedPolicy, CachedPricing, SearchCache
from workbench.planning.composed import Composed
from workbench.planning.rollouts.scout import Scout
from workbench.planning.solvers.protocol import BuiltIn
from workbench.planning.strategy import Strategy
from workbench.search.find_costs import SearchStop
from workbench.search.policy import SearchPolicy, SearchQuery, first_stop
from workbench.worlds.house import LocationId


@final
@dataclass(frozen=True, slots=True)
class FirstStopPolicy:
    """A policy reduced to its first stop; the stop's probability is not computed and reads 0."""

    policy: SearchPolicy

    @property
    def name(self) -> str:
        return self.policy.name

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        first = first_stop(self.policy, query)
        if first is None:
            return ()
        leg = query.travel.between(query.origin, LocationId(first)) or 0.0
        return (SearchStop(container=first, probability=0.0, reached=1.0, leg_m=leg),)


def fast_strategy(planner: Strategy, cache: SearchCache | None = None) -> Strategy:
    """The same strategy without explanations; a strategy that is not made of built-in parts is returned as it is.

    Args:
        cache: the searches over one log; strategies may share it.
    """
    cache = cache if cache is not None else SearchCache()
    if isinstance(planner, Composed):
        return _quiet(planner, cache)
    if isinstance(planner, Scout):
        return replace(planner, base=_quiet(planner.base, cache), cooking=_quiet(planner.cooking, cache))
    return planner


def _quiet(planner: Composed, cache: SearchCache) -> Composed:
    solver = replace(planner.solver, explain=False) if isinstance(planner.solver, BuiltIn) else planner.solver
    pricing = CachedPricing(planner.pricing, cache)
    return replace(
        planner, solver=solver, pricing=pricing, policy=FirstStopPolicy(CachedPolicy(planner.policy, cache))
    )
