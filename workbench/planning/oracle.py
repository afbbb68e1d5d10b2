"""What would a robot do that knows where everything is? The lower bound that every table shows.

It plans as if every container had been searched, and looks only into containers that hold what it takes or uses.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import final

from workbench.planning.composed import EVERYWHERE_S, Composed, types_to_believe
from workbench.planning.find_pricing import Truth
from workbench.planning.hubs import hubs_for
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.problem import locations_that_matter, problem_of
from workbench.planning.solver import BuiltIn, Solver
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import Holding, Task, goal_locations
from workbench.planning.widening import solve_widening
from workbench.search.find_costs import SearchStop
from workbench.search.oracle import oracle_policy
from workbench.worlds.house import ContainerId, House, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Oracle:
    """Knows the house that it is given.

    Attributes:
        everywhere: plans over all reachable places, as Composed does.
    """

    house: House
    name: str = "oracle"
    solver: Solver = field(default_factory=BuiltIn)
    everywhere: bool = False

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return types_to_believe(task)

    def decide(self, view: View) -> Decision:
        if view.budget_s <= 0:
            return Decision(plan=Plan(status=PlanStatus.TIMED_OUT, note="no planning time is left"))
        goal = view.task.goal
        if isinstance(goal, Holding):
            return self._single_find(view)
        all_known = self._all_known(view.knowledge)
        places = locations_that_matter(goal, all_known, hubs_for(replace(view, knowledge=all_known)))
        problem = problem_of(goal, all_known, view.costs, locations=places, find_costs=None)
        if self.everywhere:
            all_places = locations_that_matter(goal, all_known, view.knowledge.travel.locations)
            whole = replace(problem, locations=all_places)
            made = solve_widening(whole, places, budget_s=min(view.budget_s, EVERYWHERE_S))
        else:
            made = self.solver.solve(problem, budget_s=view.budget_s)
        return _with_looks(made.plan, view)

    def _single_find(self, view: View) -> Decision:
        plain = Composed(
            name=self.name, pricing=Truth(house=self.house), policy=oracle_policy(self.house), find_known=True
        )
        return plain.decide(view)

    def _all_known(self, knowledge: Knowledge) -> Knowledge:
        for container in knowledge.unsearched:
            placed = knowledge.items_at.get(LocationId(container), ())
            knowledge = knowledge.seen(container, (*self.house.contents[container], *placed))
        return knowledge


def _with_looks(plan: Plan, view: View) -> Decision:
    """The plan with a look where it first handles what only the oracle knows of."""
    knowledge = view.knowledge
    unsearched = frozenset(LocationId(c) for c in knowledge.unsearched)
    seen = {item.id for items in knowledge.items_at.values() for item in items}
    if knowledge.holding is not None:
        seen.add(knowledge.holding.id)
    holding = knowledge.holding is not None
    for k, step in enumerate(plan.steps):
        if step.origin in unsearched and any(item not in seen for item in step.items):
            return _looking_before(plan, k, view, holding=holding)
        holding = {"pick": True, "place": False}.get(step.action, holding)
    wanted = [place for place in goal_locations(view.task.goal) if place in unsearched]
    if plan.status is PlanStatus.SOLVED and not plan.steps and wanted:
        return Decision(plan=plan, look_on_the_way=(min(wanted, key=lambda place: _distance(view, place)),))
    return Decision(plan=plan)


def _distance(view: View, place: LocationId) -> float:
    """The goal is met by what nobody has seen yet: the nearest of its places is looked into first."""
    return view.knowledge.travel.between(view.knowledge.robot_at, place) or 0.0


def _looking_before(plan: Plan, k: int, view: View, *, holding: bool) -> Decision:
    """A look at the place of step k: at once where nothing else comes first, as a find where the hand is free.

    Where neither is so, the plan's steps end on arrival, and the next decision looks.
    """
    place = plan.steps[k].origin
    stop = SearchStop(container=ContainerId(place), probability=1.0, reached=1.0, leg_m=0.0)
    if all(step.action == "move" for step in plan.steps[:k]):
        return Decision(plan=plan, look_on_the_way=(place,), search_order=(stop,))
    if holding:
        note = "; ".join(filter(None, (plan.note, "the steps after these begin with a look here")))
        return Decision(plan=replace(plan, steps=plan.steps[:k], note=note))
    find = PlanStep(
        action="find",
        origin=place,
        target=place,
        item_types=plan.steps[k].item_types[:1],
        items=tuple[ItemId, ...](),
        cost=view.costs.search,
    )
    return Decision(plan=replace(plan, steps=(*plan.steps[:k], find, *plan.steps[k:])), search_order=(stop,))
