"""Does a strategy decide by what is believed? One that does not is replayed exactly whoever believes.

Greedy search with an optimistic or a pessimistic find cost goes by distance alone: both take the nearest or the
cheapest unsearched container, however probable. Only where things are to be prepared do its plans choose meeting
places by belief.
"""

from __future__ import annotations

from workbench.planning.actions import prepares
from workbench.planning.composed import Composed
from workbench.planning.find_pricing import Optimistic, Pessimistic
from workbench.planning.strategy import Strategy
from workbench.planning.tasks import Goal
from workbench.search.nearest_first import NearestFirst


def reads_beliefs(planner: Strategy, goal: Goal) -> bool:
    """Whether beliefs can change what a strategy does; True where that is not known."""
    if not isinstance(planner, Composed) or prepares(goal):
        return True
    by_distance = isinstance(planner.pricing, Optimistic | Pessimistic)
    return not (by_distance and isinstance(planner.policy, NearestFirst))


def looks_nearest_first(planner: Strategy, goal: Goal) -> bool:
    """Whether every look of a strategy goes to the nearest unsearched container; False where that is not known."""
    return isinstance(planner, Composed) and isinstance(planner.policy, NearestFirst) and not prepares(goal)


def looks_empty_handed(planner: Strategy) -> bool:
    """Whether a strategy is known to look only with its hand free; False where that is not known."""
    return isinstance(planner, Composed)
