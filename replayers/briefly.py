"""How does a strategy decide when nobody reads its reasons? The same steps, without what only people look at.

Thousands of branches need neither the ways not taken nor the order of looks beyond the first one, which is all that
the loop walks. And they ask for the same searches over and over (remembered.py).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import final

from replayers.remembered import Memory, Remembered, RememberedPricing
from workbench.planning.composed import Composed
from workbench.planning.scout import Scout
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


def briefly(planner: Strategy, memory: Memory | None = None) -> Strategy:
    """The same strategy, without words; one that is made of other parts than ours as it is.

    Args:
        memory: of the searches over one log; strategies may share it.
    """
    memory = memory if memory is not None else Memory()
    if isinstance(planner, Composed):
        return _quiet(planner, memory)
    if isinstance(planner, Scout):
        return replace(planner, base=_quiet(planner.base, memory), cooking=_quiet(planner.cooking, memory))
    return planner


def _quiet(planner: Composed, memory: Memory) -> Composed:
    solver = replace(planner.solver, explain=False) if isinstance(planner.solver, BuiltIn) else planner.solver
    pricing = RememberedPricing(planner.pricing, memory)
    return replace(planner, solver=solver, pricing=pricing, policy=FirstOnly(Remembered(planner.policy, memory)))
