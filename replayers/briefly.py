"""How does a strategy decide when nobody reads its reasons? The same steps, without what only people look at.

Thousands of branches need neither the ways not taken nor the order of looks beyond the first one, which is all that
the loop walks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

from workbench.planning.composed import Composed
from workbench.planning.solver import BuiltIn
from workbench.planning.strategy import Strategy
from workbench.search.find_costs import SearchStop
from workbench.search.policy import SearchPolicy, SearchQuery, first_stop
from workbench.worlds.house import LocationId


@final
@dataclass(frozen=True, slots=True)
class FirstOnly:
    """A policy's first stop; its chance is not worked out and stands as 0."""

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


def briefly(planner: Strategy) -> Strategy:
    """The same strategy, without words; one that is not composed as it is."""
    if not isinstance(planner, Composed):
        return planner
    solver = replace(planner.solver, explain=False) if isinstance(planner.solver, BuiltIn) else planner.solver
    return replace(planner, solver=solver, policy=FirstOnly(planner.policy))
