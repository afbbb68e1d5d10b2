"""Plans of plain deliveries, without the machinery of recipes: one recipe, nothing in hand, a type for each delivery.

Most problems of a replay are of this kind, and posing them as recipes takes longer than solving them. The plan is the
one of the general search (solver.py): the cheapest order of deliveries, where it is cheaper than every other by more
than ties (search/ties.py), and no plan that puts things down on the way is cheaper. Everything else is left to the
general search, ties among them, since its order of states decides them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations

import numpy as np

from workbench.arrays import Floats, Indices, Ints
from workbench.planning.builtin.recipe_arrays import EMPTY_OPERATIONS, MAX_POTENTIALS, routes_of
from workbench.planning.builtin.search_interface import NO_PLAN, RecipeArrays, RecipeQuery
from workbench.planning.plans import PlanStep
from workbench.planning.problem import PlanningItem, Problem, goal_alternatives
from workbench.planning.tasks import Delivered, Goal
from workbench.search.ties import first_least, tolerance
from workbench.worlds.house import LocationId

MAX_DELIVERIES = 5
"""All of whose orders are compared."""
CLEARLY = 100.0
"""How many tolerances an order must be cheaper than every other."""


@dataclass(slots=True)
class _Deliveries:
    """A problem of plain deliveries as arrays.

    Attributes:
        things: of each delivery, the instances that can be brought, by id.
        left: the deliveries that are still to be made.
        begin, end: between which locations a find is done, by type and its own ends (find_routes.py).
        table: the number of the find costs of each delivery's type; -1 without.
    """

    problem: Problem
    things: list[list[PlanningItem]]
    left: list[int]
    arrays: RecipeArrays
    metres: Floats
    begin: Ints
    end: Ints
    table: list[int]
    where: dict[LocationId, int]


def delivery_steps(problem: Problem, *, polish_nodes: int) -> tuple[tuple[PlanStep, ...], float, int] | None:
    """The steps of the cheapest plan, its cost, and how many states were expanded; None where the problem is of
    another kind, or is left to the general search."""
    ends = _destinations(problem.goal)
    if ends is None or any(thing.held for thing in problem.things):
        return None
    posed = _posed(problem, ends)
    if posed is None:
        return None
    order = _clearly_cheapest(posed)
    if order is None:
        return None
    slots, cost = order
    expanded = _expanded_without_a_better_plan(posed, cost, polish_nodes)
    return None if expanded is None else (_steps(posed, slots), cost, expanded)


@lru_cache(maxsize=256)
def _destinations(goal: Goal) -> tuple[Delivered, ...] | None:
    """The deliveries of a goal that is nothing but deliveries of things as they are, each of another type."""
    ways = goal_alternatives(goal)
    wants = ways[0] if len(ways) == 1 else ()
    plain = tuple(want for want in wants if isinstance(want, Delivered) and not want.properties)
    types = {want.item_type for want in plain}
    return plain if 0 < len(plain) == len(wants) == len(types) <= MAX_DELIVERIES else None


def _posed(problem: Problem, wants: tuple[Delivered, ...]) -> _Deliveries | None:
    from workbench.planning.builtin.lower_bounds import errand_costs

    where = {location: i for i, location in enumerate(problem.locations)}
    costs = problem.find_costs
    table = [costs.item_types.index(w.item_type) if costs and w.item_type in costs.item_types else -1 for w in wants]
    things: list[list[PlanningItem]] = [[] for _ in wants]
    slot_of = {want.item_type: s for s, want in enumerate(wants)}
    for thing in problem.things:
        if thing.type in slot_of:
            things[slot_of[thing.type]].append(thing)
    if not all(things) or any(want.at not in where for want in wants):
        return None
    widest = max([len(some) for some in things])
    at, find = np.full((len(wants), widest), -1), np.full((len(wants), widest), -1)
    for s, some in enumerate(things):
        for j, thing in enumerate(some):
            if thing.at is not None:
                at[s, j] = where[thing.at]
            else:
                find[s, j] = table[s]
    rows = problem.travel.rows(problem.locations)
    d = problem.travel.metres[rows[:, None], rows]
    end = np.array([where[want.at] for want in wants])
    centres = sorted(set(end.tolist()))[:MAX_POTENTIALS]
    potential = np.zeros((1 + len(centres), len(rows)))
    potential[1:] = d[:, centres].T
    routes = routes_of(problem, d)
    fetch, least, standing = errand_costs(at, find, routes.metres, d, potential, problem.costs.manipulation)
    op_slot, op_where, op_after, link = EMPTY_OPERATIONS
    arrays = RecipeArrays(
        d=d,
        fetch=fetch,
        least=least,
        potential=potential,
        standing=standing,
        end=end,
        in_hand=np.zeros(len(wants), dtype=np.int64),
        op_slot=op_slot,
        op_where=op_where,
        op_after=op_after,
        link=link,
        n_ops=0,
        c=problem.costs.manipulation,
    )
    left = [s for s in range(len(wants)) if not standing[s, end[s]]]
    return _Deliveries(problem, things, left, arrays, routes.metres, routes.begin, routes.end, table, where)


def _clearly_cheapest(posed: _Deliveries) -> tuple[list[int], float] | None:
    """The cheapest order of the deliveries left and its cost; None where another is about as cheap."""
    from workbench.planning.builtin.delivery_orders import two_cheapest

    a, left = posed.arrays, posed.left
    if not left or a.c <= CLEARLY * tolerance(1.0):
        return None
    orders = _orders(len(left))
    slots = np.array(left)
    here = posed.where[posed.problem.robot_at]
    row, cost, second = two_cheapest(a.fetch, a.end, slots, here, a.c, orders)
    if not np.isfinite(cost) or second - cost <= CLEARLY * tolerance(cost):
        return None
    return slots[orders[row]].tolist(), cost


@lru_cache(maxsize=MAX_DELIVERIES + 1)
def _orders(count: int) -> Indices:
    """Every order of so many things, shape (orders, count)."""
    return np.array(list(permutations(range(count))), dtype=np.int64)


def _expanded_without_a_better_plan(posed: _Deliveries, cost: float, polish_nodes: int) -> int | None:
    """How many states show that no plan which also puts things down on the way is cheaper; None if one may be."""
    from workbench.planning.builtin.astar import search

    here = posed.where[posed.problem.robot_at]
    query = RecipeQuery(robot=here, hand=-1, spent=0.0, bound=cost, max_nodes=polish_nodes, staging=True)
    status, _, _, _, expanded = search(posed.arrays, query)
    return expanded if status == NO_PLAN else None


def _steps(posed: _Deliveries, slots: list[int]) -> tuple[PlanStep, ...]:
    """The deliveries in an order as steps of a plan; of equally near instances the first by id."""
    a, problem = posed.arrays, posed.problem
    out, robot, c = list[PlanStep](), posed.where[problem.robot_at], problem.costs.manipulation
    places, costs = problem.locations, problem.find_costs

    def walk(to: int) -> None:
        nonlocal robot
        if to != robot:
            metres = float(a.d[robot, to])
            out.append(PlanStep(action="move", origin=places[robot], target=places[to], cost=metres))
            robot = to

    for s in slots:
        end = int(a.end[s])
        thing = _nearest(posed, s, robot, end)
        types, items = (thing.type,), (thing.id,)
        if thing.at is None:
            assert costs is not None, "what is missing is offered with its find costs"
            k = posed.table[s]
            first, last = int(posed.begin[k, robot, end]), int(posed.end[k, robot, end])
            walk(first)
            price = costs.of(thing.type, places[first], places[last])
            out.append(
                PlanStep(
                    action="find",
                    origin=places[first],
                    target=places[last],
                    item_types=types,
                    items=items,
                    cost=price,
                )
            )
            robot = last
        else:
            walk(posed.where[thing.at])
            here = places[robot]
            out.append(PlanStep(action="pick", origin=here, target=here, item_types=types, items=items, cost=c))
        walk(end)
        here = places[robot]
        out.append(PlanStep(action="place", origin=here, target=here, item_types=types, items=items, cost=c))
    return tuple(out)


def _nearest(posed: _Deliveries, s: int, robot: int, end: int) -> PlanningItem:
    """The instance that costs least to bring from where the robot is, the first of equal ones."""
    things, a = posed.things[s], posed.arrays
    if len(things) == 1:
        return things[0]
    costs = [
        float(posed.metres[posed.table[s], robot, end])
        if thing.at is None
        else float(a.d[robot, k := posed.where[thing.at]] + a.c + a.d[k, end])
        for thing in things
    ]
    return things[first_least(costs)]
