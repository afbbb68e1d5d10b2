"""How does a strategy decide? Find cost + search policy + solver, composed: the paper's five and most others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from workbench.beliefs.belief import Belief
from workbench.planning.actions import relevant_types
from workbench.planning.find_pricing import FindPricing, FindQuestion
from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.single_find import plan_single_find
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import Holding, Task
from workbench.search.find_costs import FindCosts, SearchStop
from workbench.search.policy import SearchPolicy, SearchQuery
from workbench.worlds.house import ItemType


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Composed:
    """A strategy made of parts.

    Attributes:
        pricing: what planning charges for a find.
        policy: where a find looks first.
        find_known: whether a find is offered though an instance is known.
    """

    name: str
    pricing: FindPricing
    policy: SearchPolicy
    find_known: bool = False

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return relevant_types(task.goal)

    def decide(self, view: View) -> Decision:
        if view.budget_s <= 0:
            return Decision(plan=Plan(status=PlanStatus.TIMED_OUT, note="no planning time is left"))
        goal = view.task.goal
        if isinstance(goal, Holding):
            return self._single_find(goal, view)
        return Decision(plan=Plan(status=PlanStatus.SOLVER_FAILED, note="this goal is not supported yet"))

    def _single_find(self, goal: Holding, view: View) -> Decision:
        knowledge = view.knowledge
        find_costs = None
        offered = self.find_known or not knowledge.knows(goal.item_type)
        if offered and knowledge.unsearched and knowledge.travel.reaches(goal.at):
            find_costs = self.pricing.price(
                FindQuestion(
                    belief=only(view.belief, (goal.item_type,)),
                    travel=knowledge.travel,
                    origins=(knowledge.robot_at,),
                    targets=(goal.at,),
                    costs=view.costs,
                )
            )
        plan = plan_single_find(goal, knowledge, find_costs, view.costs, find_known=self.find_known)
        return with_search_order(plan, find_costs, self.policy, view)


def only(belief: Belief, item_types: tuple[ItemType, ...]) -> Belief:
    """The belief about some of its types, in their order; a type that it does not have gets probability 0."""
    rows = [belief.of(t) if t in belief.item_types else np.zeros(len(belief.containers)) for t in item_types]
    probability = np.array(rows).reshape(len(item_types), len(belief.containers))
    return Belief(
        item_types=item_types, containers=belief.containers, probability=probability, estimator=belief.estimator
    )


def with_search_order(plan: Plan, find_costs: FindCosts | None, policy: SearchPolicy, view: View) -> Decision:
    """The decision for a plan: its first find gets the policy's order."""
    return Decision(plan=plan, find_costs=find_costs, search_order=_order(plan, policy, view))


def _order(plan: Plan, policy: SearchPolicy, view: View) -> tuple[SearchStop, ...]:
    first = next((step for step in plan.steps if step.action == "find"), None)
    if first is None:
        return ()
    return policy.order(
        SearchQuery(
            item_type=first.item_types[0],
            origin=first.origin,
            target=first.target,
            belief=only(view.belief, first.item_types),
            travel=view.knowledge.travel,
            costs=view.costs,
        )
    )
