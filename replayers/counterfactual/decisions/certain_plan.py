"""Whether a plan begins alike, up to its first find, at whatever find costs within bounds.

Let every find cost lie between a least and a most. Take for each find of the plan P the most, for all others the
least. At these costs a plan Q exceeds P by no more than at any others within the bounds: what both use cancels out,
what only Q uses costs at least so much, and what only P uses at most. So where every plan that begins otherwise costs
clearly more than P at these costs, none is ever the cheapest, and an exact solver always begins as P does.

Plans are taken apart by errands. The first errand of a plan of deliveries is to fetch some item; if P first brings a
known item to its place, or first finds an item from where the robot stands, the others bring another item first, or
this one elsewhere. The built-in solver's own search looks for the cheapest of them. After a known item is brought,
the rest is a plan from there.
"""

from __future__ import annotations

from dataclasses import replace

from workbench.arrays import Floats
from workbench.planning.builtin.attempts import Attempt, attempts_of, find_moves, has_state_codes
from workbench.planning.builtin.search_interface import NO_PLAN
from workbench.planning.plans import Plan, PlanStep
from workbench.planning.problem import MISSING, PlanningItem, Problem
from workbench.planning.tasks import AllOf, Delivered, Goal
from workbench.search.find_costs import FindCosts
from workbench.search.ties import tolerance
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import ItemId, LocationId

MAX_NODES = 20_000
"""States that a search for a plan that begins otherwise may expand."""


def can_be_judged(problem: Problem, plan: Plan) -> bool:
    """Whether begins_alike can tell: deliveries of items of different types, begun with an empty hand, by a plan that
    finds something, each item either known or missing."""
    held = any(thing.held for thing in problem.things)
    if held or not plan.optimal or problem.find_costs is None or not _delivers_different_types(problem.goal):
        return False
    first = next((k for k, step in enumerate(plan.steps) if step.action == "find"), None)
    if first is None or any(step.action not in ("move", "pick", "place") for step in plan.steps[:first]):
        return False
    attempts, complete = attempts_of(problem)
    slots = [slot for attempt in attempts for slot in attempt.recipe.slots]
    known_or_missing = all(len({name.startswith(MISSING) for name in slot.things}) == 1 for slot in slots)
    return complete and known_or_missing and all(has_state_codes(attempt, staging=True) for attempt in attempts)


def begins_alike(problem: Problem, plan: Plan, least: Floats, most: Floats) -> bool:
    """Whether the cheapest plan does the same up to its first find, and the same find, whatever the find costs.

    Args:
        problem: with any find costs of its locations.
        plan: an optimal plan of it that can be judged.
        least, most: what each find cost may be, of the shape of the problem's find costs.
    """
    table = problem.find_costs
    assert table is not None, "a plan with finds has find costs"
    metres = least.copy()
    for step in plan.steps:
        if step.action == "find":
            metres[_entry(table, step)] = most[_entry(table, step)]
    costs = [float(metres[_entry(table, s)]) if s.action == "find" else s.cost for s in plan.steps]
    left = sum(costs) + NEAR_COST + 10 * tolerance(sum(costs))
    stage, errand = replace(problem, find_costs=replace(table, metres=metres)), 0.0
    for step, cost in zip(plan.steps, costs, strict=True):
        if step.action == "find":
            sought = next(thing for thing in stage.things if thing.missing and thing.type == step.item_types[0])
            return step.origin == stage.robot_at and not _begins_otherwise(stage, sought.id, step.target, left)
        errand += cost
        if step.action == "place":
            if _begins_otherwise(stage, step.items[0], step.target, left):
                return False
            stage, left, errand = _after(stage, step.items[0], step.target), left - errand, 0.0
    raise AssertionError("it finds nothing")


def _begins_otherwise(problem: Problem, item: ItemId, target: LocationId, limit: float) -> bool:
    """Whether some plan below a limit brings another item first, or this one elsewhere.

    Of several that may be meant, the solver always takes the one that costs least to bring, by distance alone, and
    finds a missing one from where it stands: the tables of Eq. 1 obey the triangle inequality.
    """
    alike: dict[ItemId, None] = {}
    for attempt in attempts_of(problem)[0]:
        for slot, wanted in enumerate(attempt.recipe.slots):
            if item in wanted.things:
                alike.update(dict.fromkeys(wanted.things))
            elif _below(problem, attempt, slot, limit):
                return True
    for thing in problem.things:
        for elsewhere in problem.locations if thing.id in alike else ():
            left = limit - _cost_of_bringing(problem, thing, elsewhere)
            if elsewhere != target and left > 0:
                after = _after(problem, thing.id, elsewhere)
                if any(_below(after, attempt, -1, left) for attempt in attempts_of(after)[0]):
                    return True
    return False


def _cost_of_bringing(problem: Problem, thing: PlanningItem, target: LocationId) -> float:
    """To bring an item from where it is, or from where it is found, to a place, and to put it down there."""
    here, costs = problem.robot_at, problem.find_costs
    if thing.at is not None:
        there = problem.distance(here, thing.at) + problem.distance(thing.at, target)
        return there + 2 * problem.costs.manipulation
    assert costs is not None, "what is missing has find costs"
    return costs.of(thing.type, here, target) + problem.costs.manipulation


def _below(problem: Problem, attempt: Attempt, first: int, limit: float) -> bool:
    """Whether some plan costs less than a limit, or may; it begins with a slot, or with any (-1)."""
    return find_moves(problem, attempt, limit, MAX_NODES, first=first, staging=True)[0] != NO_PLAN


def _after(problem: Problem, item: ItemId, target: LocationId) -> Problem:
    """The problem after a known item was brought somewhere."""
    things = tuple(replace(thing, at=target) if thing.id == item else thing for thing in problem.things)
    return replace(problem, robot_at=target, things=things)


def _entry(table: FindCosts, step: PlanStep) -> tuple[int, int, int]:
    at = table.item_types.index(step.item_types[0])
    return at, table.origins.index(step.origin), table.targets.index(step.target)


def _delivers_different_types(goal: Goal) -> bool:
    parts = goal.parts if isinstance(goal, AllOf) else (goal,)
    delivered = [part for part in parts if isinstance(part, Delivered) and not part.properties]
    return len(delivered) == len(parts) == len({part.item_type for part in delivered})
