"""Traits of strategies: whether they use beliefs, look nearest first, or look only with an empty hand.

A strategy that does not use beliefs is replayed exactly whatever the beliefs. Greedy search with an optimistic or a
pessimistic find cost depends on distance alone: both take the nearest or the cheapest unsearched container, however
probable. Only where items are to be prepared do its plans choose meeting places by belief.
"""

from __future__ import annotations

from workbench.planning.actions import prepares
from workbench.planning.composed import Composed
from workbench.planning.find_pricing import Optimistic, Pessimistic
from workbench.planning.strategy import Strategy
from workbench.planning.tasks import Goal
from workbench.search.policies.nearest_first import NearestFirst


def uses_beliefs(planner: Strategy, goal: Goal) -> bool:
    """Whether beliefs can change what a strategy does; True where that is unknown."""
    if not isinstance(planner, Composed) or prepares(goal):
        return True
    by_distance = isinstance(planner.pricing, Optimistic | Pessimistic)
    return not (by_distance and isinstance(planner.policy, NearestFirst))


def looks_nearest_first(planner: Strategy, goal: Goal) -> bool:
    """Whether every look of a strategy goes to the nearest unsearched container; False where that is unknown."""
    return isinstance(planner, Composed) and isinstance(planner.policy, NearestFirst) and not prepares(goal)


def looks_empty_handed(planner: Strategy) -> bool:
    """Whether a strategy is known to look only with an empty hand; False where that is unknown."""
    return isinstance(planner, Composed)
