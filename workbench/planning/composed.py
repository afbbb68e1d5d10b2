"""Strategies composed of a find cost, a search policy and a solver: the paper's five and most others."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import final

from workbench.planning.actions import relevant_types
from workbench.planning.builtin.plan_writer import without_hypothetical
from workbench.planning.find_pricing import FindCostRequest, FindPricing
from workbench.planning.hubs import hubs_for
from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.problem import Problem, missing_types, problem_of, relevant_locations
from workbench.planning.solvers.location_refinement import solve_widening
from workbench.planning.solvers.protocol import BuiltIn, Solver
from workbench.planning.solvers.single_find import plan_single_find
from workbench.planning.strategy import Alternative, Decision, View
from workbench.planning.tasks import Holding, Task
from workbench.search.find_costs import FindCosts, SearchStop
from workbench.search.policy import SearchPolicy, SearchQuery
from workbench.worlds.house import ItemType, LocationId

EVERYWHERE_S = 5.0


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Composed:
    """A strategy made of parts.

    Attributes:
        pricing: the find costs used for planning.
        policy: the order in which a find searches containers.
        find_known: whether a find may be planned even if an instance is known.
        solver: the solver; a single find is solved in closed form.
        looks_again: whether it may choose at every decision to look again into a container (further_looks.py).
        everywhere: plan over all reachable locations, bounded by the plan over the relevant ones, and state the
            optimality gap (location_refinement.py); takes at most EVERYWHERE_S seconds per decision. With another
            solver than the built-in one: hand it the whole problem, with every known item, of any type.
    """

    name: str
    pricing: FindPricing
    policy: SearchPolicy
    find_known: bool = False
    solver: Solver = field(default_factory=BuiltIn)
    everywhere: bool = False
    looks_again: bool = False

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return belief_types(task)

    def decide(self, view: View) -> Decision:
        if view.budget_s <= 0:
            return Decision(plan=Plan(status=PlanStatus.TIMED_OUT, note="no planning time is left"))
        goal = view.task.goal
        if self.widens and not isinstance(goal, Holding):
            return self._everywhere(view)
        problem = self.problem(view)
        if isinstance(goal, Holding):
            plan = plan_single_find(goal, view.knowledge, problem.find_costs, view.costs, find_known=self.find_known)
            return with_search_order(plan, problem.find_costs, self.policy, view)
        made = self.solver.solve(problem, budget_s=view.budget_s)
        plan = with_location_note(made.plan, problem)
        return with_search_order(plan, problem.find_costs, self.policy, view, made.alternatives)

    def problem(self, view: View) -> Problem:
        """The planning problem that this strategy poses for a view."""
        places = view.knowledge.travel.locations if self.unpruned else None
        return problem_at(view, self.pricing, find_known=self.find_known, places=places, every_item=self.unpruned)

    @property
    def widens(self) -> bool:
        """Whether it plans over the relevant locations, then over all."""
        return self.everywhere and isinstance(self.solver, BuiltIn)

    @property
    def unpruned(self) -> bool:
        """Whether its solver is given all reachable locations and known items."""
        return self.everywhere and not self.widens

    def _everywhere(self, view: View) -> Decision:
        core = self.problem(view).locations
        places = view.knowledge.travel.locations
        problem = problem_at(view, self.pricing, find_known=self.find_known, places=places)
        made = solve_widening(problem, core, budget_s=min(view.budget_s, EVERYWHERE_S))
        plan = without_hypothetical(made.plan)
        return with_search_order(plan, problem.find_costs, self.policy, view, made.alternatives)


def with_location_note(plan: Plan, problem: Problem) -> Plan:
    """The plan with a note that its bound holds over the problem's locations only."""
    all_places = len(problem.travel.locations)
    if plan.status is not PlanStatus.SOLVED or plan.note or len(problem.locations) == all_places:
        return plan
    return replace(plan, note=f"over {len(problem.locations)} of {all_places} places")


def belief_types(task: Task) -> tuple[ItemType, ...]:
    """The relevant item types that exist in the house."""
    types = relevant_types(task.goal)
    return tuple(t for t in types if t in task.available) if task.available else types


def problem_at(
    view: View,
    pricing: FindPricing,
    *,
    find_known: bool = False,
    places: tuple[LocationId, ...] | None = None,
    every_item: bool = False,
) -> Problem:
    """The planning problem of a view, with find costs.

    Args:
        places: further locations to plan over; by default hubs and the pricing's meeting places.
        every_item: with known items of types that do not matter to the goal, too.
    """
    goal, knowledge = view.task.goal, view.knowledge
    types = missing_types(goal, knowledge, view.task.available, find_known=find_known)
    locations: tuple[LocationId, ...]
    if isinstance(goal, Holding):
        ends = (knowledge.robot_at, goal.at) if knowledge.travel.reaches(goal.at) else (knowledge.robot_at,)
        locations = tuple(dict.fromkeys(ends))
    else:
        if places is None:
            places = (*hubs_for(view), *pricing.meeting_places(view.belief.only(types)))
        locations = relevant_locations(goal, knowledge, places)
    find_costs = None
    if types:
        request = FindCostRequest(
            belief=view.belief.only(types),
            travel=knowledge.travel,
            origins=locations,
            targets=locations,
            costs=view.costs,
        )
        find_costs = pricing.price(request)
    return problem_of(goal, knowledge, view.costs, locations=locations, find_costs=find_costs, every_item=every_item)


def with_search_order(
    plan: Plan,
    find_costs: FindCosts | None,
    policy: SearchPolicy,
    view: View,
    alternatives: tuple[Alternative, ...] = (),
) -> Decision:
    """The decision for a plan, with the policy's search order for the plan's first find."""
    order = _order(plan, policy, view)
    return Decision(plan=plan, find_costs=find_costs, search_order=order, alternatives=alternatives)


def _order(plan: Plan, policy: SearchPolicy, view: View) -> tuple[SearchStop, ...]:
    first = next((step for step in plan.steps if step.action == "find"), None)
    if first is None:
        return ()
    return policy.order(
        SearchQuery(
            item_type=first.item_types[0],
            origin=first.origin,
            target=first.target,
            belief=view.belief.only(first.item_types),
            travel=view.knowledge.travel,
            costs=view.costs,
        )
    )
