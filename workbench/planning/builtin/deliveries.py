"""Plans of plain deliveries: one recipe, nothing in hand, a type for each delivery.

Most problems of a replay are of this kind, and ranking recipes and searching orders takes longer than comparing all
orders. The plan is the one of the general search (solver.py): the cheapest order of deliveries, where it is cheaper
than every other by more than ties (search/ties.py), and no plan that puts things down on the way is cheaper. All else
is left to the general search, ties among them, since its order of states decides them.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import permutations

import numpy as np

from workbench.arrays import Indices, Ints
from workbench.planning.builtin.attempts import Attempt, find_moves, has_state_codes
from workbench.planning.builtin.plan_writer import steps_of
from workbench.planning.builtin.recipe_arrays import arrays_of, routes_of
from workbench.planning.builtin.recipes import Recipe, Slot
from workbench.planning.builtin.search_interface import FETCH, NO_PLAN, PLACE
from workbench.planning.plans import PlanStep
from workbench.planning.problem import Problem
from workbench.planning.tasks import Delivered, distinct_deliveries
from workbench.search.ties import tolerance
from workbench.worlds.house import ItemId, ItemType

MAX_DELIVERIES = 5
"""All of whose orders are compared."""
CLEARLY = 100.0
"""How many tolerances an order must be cheaper than every other, and a manipulation must cost."""


def delivery_steps(problem: Problem, *, polish_nodes: int) -> tuple[tuple[PlanStep, ...], float, int] | None:
    """The steps of the cheapest plan, its cost, and how many states were expanded; None where the problem is of
    another kind, or is left to the general search."""
    wants = distinct_deliveries(problem.goal)
    if not 0 < len(wants) <= MAX_DELIVERIES or any(thing.held for thing in problem.things):
        return None
    recipe = _recipe(problem, wants)
    if recipe is None:
        return None
    routes = routes_of(problem)
    attempt = Attempt(recipe, arrays_of(problem, recipe, routes), routes, -1, False)
    found = _clearly_cheapest(problem, attempt)
    if found is None or not has_state_codes(attempt, staging=True):
        return None
    moves, cost = found
    status, _, _, _, expanded = find_moves(problem, attempt, cost, polish_nodes, staging=True)
    return (steps_of(problem, attempt, moves), cost, expanded) if status == NO_PLAN else None


def _recipe(problem: Problem, wants: tuple[Delivered, ...]) -> Recipe | None:
    """The only recipe; None where an item is lacking, or a place is out of reach."""
    things: dict[ItemType, list[ItemId]] = {}
    for thing in problem.things:
        things.setdefault(thing.type, []).append(thing.id)
    if any(want.item_type not in things or want.at not in problem.locations for want in wants):
        return None
    return Recipe(slots=tuple([Slot(type=w.item_type, end=w.at, things=tuple(things[w.item_type])) for w in wants]))


def _clearly_cheapest(problem: Problem, attempt: Attempt) -> tuple[Ints, float] | None:
    """The moves of the cheapest order of the deliveries left, in reverse order, and its cost; None where another is
    about as cheap."""
    from workbench.planning.builtin.delivery_orders import two_cheapest

    a = attempt.arrays
    left = np.array([s for s, end in enumerate(a.end) if not a.standing[s, end]], dtype=np.int64)
    if not len(left):
        return None
    orders, here = _orders(len(left)), problem.locations.index(problem.robot_at)
    row, cost, second = two_cheapest(a.fetch, a.end, left, here, a.c, orders)
    if not np.isfinite(cost) or min(second - cost, a.c) <= CLEARLY * tolerance(cost):
        return None
    slots = left[orders[row]].tolist()
    moves = [(kind, slot, int(a.end[slot])) for slot in reversed(slots) for kind in (PLACE, FETCH)]
    return np.array(moves, dtype=np.int64), cost


@lru_cache(maxsize=MAX_DELIVERIES + 1)
def _orders(count: int) -> Indices:
    """Every order of so many things, shape (orders, count)."""
    return np.array(list(permutations(range(count))), dtype=np.int64)
