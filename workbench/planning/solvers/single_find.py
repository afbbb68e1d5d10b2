"""The optimal plan for bringing one item to one place, in closed form.

If an instance is known: walk there, pick it, walk to the target. If not: one find. If something else is in hand, it
is put down first.
"""

from __future__ import annotations

from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.tasks import Holding
from workbench.search.costs import ActionCosts
from workbench.search.find_costs import FindCosts
from workbench.search.ties import first_of_least, tolerance
from workbench.worlds.house import Item, LocationId
from workbench.worlds.knowledge import Knowledge

SOLVER = "closed-form"


def plan_single_find(
    goal: Holding, knowledge: Knowledge, find_costs: FindCosts | None, costs: ActionCosts, *, find_known: bool = False
) -> Plan:
    """The optimal plan under these find costs.

    Args:
        find_costs: costs that cover the goal's type, the robot's location and the goal's location; None if no
            find may be planned.
        find_known: whether a find may be chosen even if an instance is known.
    """
    here, to = knowledge.robot_at, goal.at
    if not knowledge.travel.reaches(to):
        return Plan(status=PlanStatus.NO_PLAN, solver=SOLVER, note=f"{to} cannot be reached")
    steps: list[PlanStep] = []
    held = knowledge.holding
    if held is not None and held.type == goal.item_type:
        return _solved(steps + _walk(knowledge, here, to))
    if held is not None:
        steps.append(_handle("place", here, held, costs))
    options = [
        (length + costs.manipulation, location, item)
        for location, item in knowledge.where(goal.item_type)
        if (length := _by_way_of(knowledge, here, location, to)) is not None
    ]
    options.sort(key=lambda option: (option[1], option[2].id))
    known = first_of_least(options, lambda option: option[0]) if options else None
    find: list[PlanStep] = []
    if find_costs is not None and goal.item_type in find_costs.item_types and (known is None or find_known):
        find = _find(goal, knowledge, find_costs)
    find_cost = sum(step.cost for step in find)
    if known is not None and (not find or known[0] <= find_cost + tolerance(find_cost)):
        _, place, item = known
        steps += _walk(knowledge, here, place)
        steps.append(_handle("pick", place, item, costs))
        return _solved(steps + _walk(knowledge, place, to))
    if not find:
        note = f"no {goal.item_type} is known and no container is left to search"
        return Plan(status=PlanStatus.NO_PLAN, solver=SOLVER, note=note)
    return _solved(steps + find)


def _find(goal: Holding, knowledge: Knowledge, find_costs: FindCosts) -> list[PlanStep]:
    """The find from here to the goal's place, or between two of the two places with the walks, if that costs less."""
    here, to = knowledge.robot_at, goal.at
    options: list[list[PlanStep]] = []
    for begin, end in ((here, to), (to, to), (here, here), (to, here)):
        cost = find_costs.of(goal.item_type, begin, end)
        find = PlanStep(action="find", origin=begin, target=end, item_types=(goal.item_type,), cost=cost)
        options.append([*_walk(knowledge, here, begin), find, *_walk(knowledge, end, to)])
    return first_of_least(options, lambda option: sum(step.cost for step in option))


def _by_way_of(knowledge: Knowledge, a: LocationId, b: LocationId, c: LocationId) -> float | None:
    first, second = knowledge.travel.between(a, b), knowledge.travel.between(b, c)
    return None if first is None or second is None else first + second


def _walk(knowledge: Knowledge, a: LocationId, b: LocationId) -> list[PlanStep]:
    if a == b:
        return []
    return [PlanStep(action="move", origin=a, target=b, cost=knowledge.travel.between(a, b) or 0.0)]


def _handle(action: str, at: LocationId, item: Item, costs: ActionCosts) -> PlanStep:
    return PlanStep(
        action=action,
        origin=at,
        target=at,
        item_types=(item.type,),
        items=(item.id,),
        cost=costs.manipulation,
    )


def _solved(steps: list[PlanStep]) -> Plan:
    cost = sum(step.cost for step in steps)
    return Plan(
        status=PlanStatus.SOLVED, steps=tuple(steps), cost=cost, lower_bound=cost, optimal=True, solver=SOLVER
    )
