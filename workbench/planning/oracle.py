"""The oracle, a strategy that knows where everything is: the lower bound of every table.

It plans as if every container had been searched, and looks only into containers that hold an item that it uses.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import final

from workbench.planning.composed import EVERYWHERE_S, Composed, belief_types
from workbench.planning.find_pricing import TrueFindCosts
from workbench.planning.hubs import hubs_for
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.problem import (
    Problem,
    apply,
    goal_alternatives,
    holds,
    initial_state,
    problem_of,
    relevant_locations,
    satisfies_want,
)
from workbench.planning.solvers.location_refinement import solve_widening
from workbench.planning.solvers.protocol import BuiltIn, Solver
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import AllOf, Holding, Task, goal_locations
from workbench.search.find_costs import SearchStop
from workbench.search.policies.oracle import oracle_policy
from workbench.search.ties import first_least, first_of_least
from workbench.worlds.house import ContainerId, House, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge

MAX_ALTERNATIVES = 64
"""Most ways of meeting a goal that are compared where unseen items meet part of it already."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Oracle:
    """A strategy that plans on the true house.

    Attributes:
        everywhere: plan over all reachable locations, as in Composed.
    """

    house: House
    name: str = "oracle"
    solver: Solver = field(default_factory=BuiltIn)
    everywhere: bool = False

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return belief_types(task)

    def decide(self, view: View) -> Decision:
        if view.budget_s <= 0:
            return Decision(plan=Plan(status=PlanStatus.TIMED_OUT, note="no planning time is left"))
        goal = view.task.goal
        if isinstance(goal, Holding):
            return self._single_find(view)
        all_known = self._full_knowledge(view.knowledge)
        places = relevant_locations(goal, all_known, hubs_for(replace(view, knowledge=all_known)))
        problem = problem_of(goal, all_known, view.costs, locations=places, find_costs=None)
        best = self._plan_with_looks(self._plan(problem, view), problem, view)
        if best.places:  # another way of meeting the goal may need no walk to what nobody has seen
            tours = [best]
            for alternative in goal_alternatives(goal)[:MAX_ALTERNATIVES]:
                narrowed = replace(problem, goal=AllOf(parts=alternative))
                tours.append(self._plan_with_looks(self._plan(narrowed, view), narrowed, view))
            best = first_of_least(tours, lambda tour: tour.cost)
        return _insert_looks(best.plan, view, best.look, best.places)

    def _plan(self, problem: Problem, view: View) -> Plan:
        if not self.everywhere:
            return self.solver.solve(problem, budget_s=view.budget_s).plan
        all_places = relevant_locations(problem.goal, self._full_knowledge(view.knowledge), problem.travel.locations)
        whole = replace(problem, locations=all_places)
        return solve_widening(whole, problem.locations, budget_s=min(view.budget_s, EVERYWHERE_S)).plan

    def _plan_with_looks(self, plan: Plan, problem: Problem, view: View) -> _PlanWithLooks:
        """The plan's cost including the looks needed to observe that the goal is met, and the first of these
        looks."""
        if plan.status is not PlanStatus.SOLVED:
            return _PlanWithLooks(plan=plan, cost=float("inf"))
        places = _unseen_goal_places(plan, problem, view)
        route = (problem.robot_at, *(step.target for step in plan.steps))
        detours = [_detour(route, place, problem) for place in places]
        cost = plan.cost + sum(length for length, _, _ in detours)
        look = min(((index, place) for _, index, place in detours), default=None)
        return _PlanWithLooks(plan=plan, cost=cost, look=look, places=places)

    def _single_find(self, view: View) -> Decision:
        plain = Composed(
            name=self.name, pricing=TrueFindCosts(house=self.house), policy=oracle_policy(self.house), find_known=True
        )
        return plain.decide(view)

    def _full_knowledge(self, knowledge: Knowledge) -> Knowledge:
        for container in knowledge.unsearched:
            placed = knowledge.items_at.get(LocationId(container), ())
            knowledge = knowledge.seen(container, (*self.house.contents[container], *placed))
        return knowledge


@dataclass(frozen=True, slots=True, kw_only=True)
class _PlanWithLooks:
    """A plan and the places that must still be looked into so that the robot observes that the goal is met.

    Attributes:
        cost: cost of the plan including the detours to those places.
        look: the index of the step before which the first such place is visited, and the place.
        places: all such places.
    """

    plan: Plan
    cost: float
    look: tuple[int, LocationId] | None = None
    places: tuple[LocationId, ...] = ()


def _unseen_goal_places(plan: Plan, problem: Problem, view: View) -> tuple[LocationId, ...]:
    """The smallest set of places whose unseen items meet part of the goal at the end of the plan."""
    state = initial_state(problem)
    for step in plan.steps:
        state = apply(step, state)
    known = {item for step in plan.steps for item in step.items} | _observed_items(view.knowledge)
    alternatives: list[tuple[LocationId, ...]] = []
    for alternative in goal_alternatives(problem.goal):
        if holds(AllOf(parts=alternative), state, problem):
            sure = [
                any(t.id in known and satisfies_want(want, t.id, state) for t in problem.of_type(want.item_type))
                for want in alternative
            ]
            alternatives.append(
                tuple(sorted({want.at for want, seen in zip(alternative, sure, strict=True) if not seen}))
            )
    return min(alternatives, key=lambda places: (len(places), places), default=())


def _detour(route: tuple[LocationId, ...], place: LocationId, problem: Problem) -> tuple[float, int, LocationId]:
    """The cheapest insertion of a place into a route: (extra metres, index of the step after it, place)."""
    if place in route:
        return 0.0, route.index(place), place
    lengths = [
        problem.distance(a, place) + problem.distance(place, b) - problem.distance(a, b) for a, b in pairwise(route)
    ]
    in_hand = any(
        isinstance(want, Holding) for alternative in goal_alternatives(problem.goal) for want in alternative
    )
    lengths.append(problem.distance(route[-1], place) * (2 if in_hand else 1))  # and back, where the goal ends
    least = first_least(lengths, scale=max(lengths))
    return lengths[least], least, place


def _observed_items(knowledge: Knowledge) -> set[ItemId]:
    seen = {item.id for items in knowledge.items_at.values() for item in items}
    return seen | ({knowledge.holding.id} if knowledge.holding is not None else set())


def _insert_looks(
    plan: Plan, view: View, detour: tuple[int, LocationId] | None, places: tuple[LocationId, ...]
) -> Decision:
    """The decision for a plan, with a look where it first handles an unseen item or where an unseen item meets the
    goal."""
    knowledge = view.knowledge
    unsearched = frozenset(LocationId(c) for c in knowledge.unsearched)
    seen = _observed_items(knowledge)
    holding = knowledge.holding is not None
    if knowledge.robot_at in unsearched and knowledge.robot_at in places:
        return Decision(plan=plan, look_on_the_way=(knowledge.robot_at,))
    for k, step in enumerate(plan.steps):
        if detour is not None and k == detour[0]:
            return Decision(plan=plan, steps_now=k) if k else Decision(plan=plan, look_on_the_way=(detour[1],))
        if step.origin in unsearched and any(item not in seen for item in step.items):
            return _look_before_step(plan, k, view, holding=holding)
        holding = {"pick": True, "place": False}.get(step.action, holding)
    wanted = [place for place in places or goal_locations(view.task.goal) if place in unsearched]
    if plan.status is PlanStatus.SOLVED and not plan.steps and wanted:
        return Decision(plan=plan, look_on_the_way=(first_of_least(wanted, lambda place: _distance(view, place)),))
    return Decision(plan=plan)


def _distance(view: View, place: LocationId) -> float:
    """The distance in metres from the robot to a place; 0 for an unreachable one."""
    return view.knowledge.travel.between(view.knowledge.robot_at, place) or 0.0


def _look_before_step(plan: Plan, k: int, view: View, *, holding: bool) -> Decision:
    """A look at the location of step k: immediate if no step precedes it, otherwise as a find if the hand is free.

    In all other cases the plan is cut at arrival, and the next decision looks.
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
