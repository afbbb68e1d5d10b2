"""Plans of plain deliveries: one recipe, nothing in hand, a type for each delivery.

Most problems of a replay are of this kind, and ranking recipes and searching orders takes longer than comparing all
orders. The plan is the one of the general search (solver.py): the cheapest order of deliveries, where it is cheaper
than every other by more than ties (search/ties.py), and no plan that puts things down on the way is cheaper. All else
is left to the general search, ties among them, since its order of states decides them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations

import numpy as np

from workbench.arrays import Indices
from workbench.planning.builtin.attempts import has_codes_of_all
from workbench.planning.builtin.recipe_arrays import EMPTY_OPERATIONS, find_tables
from workbench.planning.plans import PlanStep
from workbench.planning.problem import PlanningItem, Problem
from workbench.planning.tasks import Delivered, distinct_deliveries
from workbench.worlds.house import ItemId, ItemType, LocationId

MAX_DELIVERIES = 5
"""All of whose orders are compared."""
CLEARLY = 100.0
"""How many tolerances an order must be cheaper than every other, and a manipulation must cost."""
NONE_IN_HAND = np.zeros(MAX_DELIVERIES, dtype=np.int64)
MAX_STEPS_KEPT = 10_000
"""Steps are values, and the same ones are written thousands of times."""


def delivery_steps(problem: Problem, *, polish_nodes: int) -> tuple[tuple[PlanStep, ...], float, int] | None:
    """The steps of the cheapest plan, its cost, and how many states were expanded; None where the problem is of
    another kind, or is left to the general search."""
    wants = distinct_deliveries(problem.goal)
    if not 0 < len(wants) <= MAX_DELIVERIES:
        return None
    things: dict[ItemType, list[PlanningItem]] = {want.item_type: [] for want in wants}
    for thing in problem.things:
        if thing.held:
            return None
        if thing.type in things:
            things[thing.type].append(thing)
    where = {location: i for i, location in enumerate(problem.locations)}
    slots = list(things.values())
    if not all(slots) or any(want.at not in where for want in wants) or not has_codes_of_all(len(where), len(slots)):
        return None
    found = _cheapest(problem, wants, slots, where, polish_nodes)
    return None if found is None else _written(problem, wants, slots, where, found)


@dataclass(frozen=True, slots=True)
class _Found:
    """The cheapest order.

    Attributes:
        errands: slot, instance, and the places between which a missing one is found, of each errand in order.
        cost: of the plan.
        expanded: states that were expanded to prove that no plan that puts things down on the way is cheaper.
    """

    errands: list[tuple[int, int, int, int]]
    cost: float
    expanded: int


def _cheapest(
    problem: Problem,
    wants: tuple[Delivered, ...],
    slots: list[list[PlanningItem]],
    where: dict[LocationId, int],
    polish_nodes: int,
) -> _Found | None:
    """The cheapest order of the deliveries left; None where another plan is about as cheap."""
    from workbench.planning.builtin.delivery_orders import cheapest_delivery

    most = max([len(instances) for instances in slots])
    types = () if problem.find_costs is None else problem.find_costs.item_types
    at, find, ends = [], [], [where[want.at] for want in wants]
    for instances in slots:
        padding = [-1] * (most - len(instances))
        at.append([-1 if thing.at is None else where[thing.at] for thing in instances] + padding)
        offered = [thing.at is None and thing.type in types for thing in instances]
        find.append([types.index(instances[0].type) if is_offered else -1 for is_offered in offered] + padding)
    left = [s for s, end in enumerate(ends) if end not in at[s]]
    if not left:
        return None
    orders = _orders(tuple(left))
    row, cost, expanded, legs = cheapest_delivery(  # of copies: for read-only arrays it would be compiled once more
        problem.travel.metres,
        problem.travel.rows(problem.locations).copy(),
        find_tables(problem).copy(),
        np.array(at),
        np.array(find),
        np.array(ends),
        NONE_IN_HAND[: len(ends)],
        EMPTY_OPERATIONS,
        where[problem.robot_at],
        float(problem.costs.manipulation),
        orders,
        CLEARLY,
        polish_nodes,
    )
    if row < 0:
        return None
    errands = [(s, j, a, b) for s, (j, a, b) in zip(orders[row].tolist(), legs.tolist(), strict=True)]
    return _Found(errands, cost, expanded)


@lru_cache(maxsize=1 << MAX_DELIVERIES)
def _orders(things: tuple[int, ...]) -> Indices:
    """Every order of some things, shape (orders, things)."""
    return np.array(list(permutations(things)), dtype=np.int64)


def _written(
    problem: Problem,
    wants: tuple[Delivered, ...],
    slots: list[list[PlanningItem]],
    where: dict[LocationId, int],
    found: _Found,
) -> tuple[tuple[PlanStep, ...], float, int]:
    """The steps of a plan."""
    places, costs, c = problem.locations, problem.find_costs, problem.costs.manipulation
    robot, steps = problem.robot_at, list[PlanStep]()

    def walk(to: LocationId) -> None:
        nonlocal robot
        if to != robot:
            steps.append(plan_step("move", robot, to, (), (), problem.distance(robot, to)))
            robot = to

    for slot, instance, begin, end in found.errands:
        thing, target = slots[slot][instance], wants[slot].at
        names = (thing.type,), (thing.id,)
        if thing.at is not None:
            walk(thing.at)
            steps.append(plan_step("pick", robot, robot, *names, c))
        else:
            assert costs is not None, "what is missing is offered with its find costs"
            walk(places[begin])
            steps.append(plan_step("find", robot, places[end], *names, costs.of(thing.type, robot, places[end])))
            robot = places[end]
        walk(target)
        steps.append(plan_step("place", robot, robot, *names, c))
    return tuple(steps), found.cost, found.expanded


@lru_cache(maxsize=MAX_STEPS_KEPT, typed=True)
def plan_step(
    action: str,
    origin: LocationId,
    target: LocationId,
    types: tuple[ItemType, ...],
    items: tuple[ItemId, ...],
    cost: float,
) -> PlanStep:
    return PlanStep(action=action, origin=origin, target=target, item_types=types, items=items, cost=cost)
