"""Traits of strategies: whether they use beliefs, look nearest first, or look only with an empty hand; which decide
alike.

A strategy that does not use beliefs is replayed exactly whatever the beliefs. Greedy search with an optimistic or a
pessimistic find cost depends on distance alone: both take the nearest or the cheapest unsearched container, however
probable. Only where items are to be prepared do its plans choose meeting places by belief.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

from workbench.planning.actions import prepares
from workbench.planning.composed import Composed
from workbench.planning.find_pricing import Expected, Optimistic, Pessimistic
from workbench.planning.solvers.protocol import BuiltIn
from workbench.planning.strategy import Strategy
from workbench.planning.tasks import AllOf, Goal, Holding, distinct_deliveries
from workbench.search.policies.nearest_first import NearestFirst
from workbench.search.policy import SearchPolicy


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchTraits:
    """What is known of a strategy's runs, by which their costs are bounded from above; False where it is unknown.

    Attributes:
        nearest_first: its looks go to the nearest unsearched container.
        empty_handed: it looks only with an empty hand; others may look on the way with what they fetched.
        plans_shortest: once nothing is missing, it carries out a plan that costs no more than the best of those that
            bring every item straight to its place.
        fetches_nearest: its plans go by distance alone, and it never fetches an item where another of its type costs
            less on its path: histories that differ in such items alone share a node (decisions/needed_items.py).
    """

    nearest_first: bool = False
    empty_handed: bool = False
    plans_shortest: bool = False
    fetches_nearest: bool = False


UNKNOWN = SearchTraits()
"""Of a strategy of which nothing is known."""


def search_traits(planner: Strategy, goal: Goal) -> SearchTraits:
    """The traits of a strategy for a goal."""
    return SearchTraits(
        nearest_first=looks_nearest_first(planner, goal),
        empty_handed=looks_empty_handed(planner),
        plans_shortest=plans_shortest(planner, goal),
        fetches_nearest=decision_kind(planner, goal) is not None,
    )


def uses_beliefs(planner: Strategy, goal: Goal) -> bool:
    """Whether beliefs can change what a strategy does; True where that is unknown."""
    return not isinstance(looks_by(planner, goal), NearestFirst)


def looks_by(planner: Strategy, goal: Goal) -> SearchPolicy | None:
    """The search policy of a strategy whose plans go by distance alone, so that beliefs change nothing but where it
    looks; None where its plans may depend on them."""
    if not isinstance(planner, Composed) or prepares(goal):
        return None
    return planner.policy if isinstance(planner.pricing, Optimistic | Pessimistic) else None


def eq1_parts(planner: Strategy) -> Composed | None:
    """A strategy that takes the cheapest plan by Eq. 1, whose find costs of a type depend on beliefs about that type
    alone, and obey the triangle inequality; None for others, and where that is unknown."""
    if not isinstance(planner, Composed) or not isinstance(planner.solver, BuiltIn):
        return None
    if planner.find_known or planner.everywhere or planner.looks_again:
        return None
    return planner if isinstance(planner.pricing, Expected) and not planner.pricing.per_find else None


def looks_nearest_first(planner: Strategy, goal: Goal) -> bool:
    """Whether every look of a strategy goes to the nearest unsearched container; False where that is unknown."""
    return isinstance(planner, Composed) and isinstance(planner.policy, NearestFirst) and not prepares(goal)


def looks_empty_handed(planner: Strategy) -> bool:
    """Whether a strategy is known to look only with an empty hand; False where that is unknown."""
    return isinstance(planner, Composed)


def plans_shortest(planner: Strategy, goal: Goal) -> bool:
    """Whether a strategy, once nothing is missing, carries out a plan as cheap as the best of those that bring every
    item straight to its place; False where that is unknown. The built-in solver finds these plans first."""
    if not isinstance(planner, Composed) or prepares(goal):
        return False
    return isinstance(planner.solver, BuiltIn) and not planner.find_known


def decision_kind(planner: Strategy, goal: Goal) -> Hashable | None:
    """What a strategy has in common with those that decide alike for a goal; None where none is known to.

    A pessimistic find cost is the optimistic one and a constant. Where every plan has as many finds, one for each
    type that is missing, that adds the same to all plans and, in the search for them, to all states: the costs and
    lower bounds of the built-in solver are sums over what is still to be fetched. So the same plan is taken.
    """
    if not isinstance(planner, Composed) or not isinstance(planner.solver, BuiltIn):
        return None
    if planner.find_known or planner.everywhere or planner.looks_again or not _one_find_a_type(goal):
        return None
    return planner.policy if isinstance(planner.pricing, Optimistic | Pessimistic) else None


def _one_find_a_type(goal: Goal) -> bool:
    """Whether every plan finds each missing type once: one item held, or one of each type delivered as it is."""
    parts = goal.parts if isinstance(goal, AllOf) else (goal,)
    return bool(distinct_deliveries(goal)) or (len(parts) == 1 and isinstance(parts[0], Holding))
