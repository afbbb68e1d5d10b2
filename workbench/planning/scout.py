"""Which look is worth most for everything that is missing? Our strategy beyond one object at a time.

A find looks for one type and plans as if nothing else could turn up. But every container shows all that it holds,
and many lie on the way. So before each decision of the base strategy, scout-lios asks of each container worth it:
what would it cost to look there now, and what would the best plan cost after each thing that the look may show?

    Q(c) = d(here, c) + R_search + sum over outcomes of P(outcome) V(after the outcome)

V is the base strategy's plan cost with the belief after the look: what is found is known at c, what is not found is
conditioned on being elsewhere. This is one step of policy improvement over the base strategy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import final

import numpy as np
import numpy.typing as npt

from workbench.beliefs.belief import Belief
from workbench.planning.actions import prepares
from workbench.planning.built_in import solve
from workbench.planning.composed import Composed, problem_at, types_to_believe
from workbench.planning.plans import PlanStatus
from workbench.planning.single_find import plan_single_find
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import Holding, Task
from workbench.search.find_costs import SearchStop
from workbench.worlds.house import ContainerId, Item, ItemId, ItemType, LocationId


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Scout:
    """Looks where it is worth most over a base strategy.

    Attributes:
        base: plans, and prices what may come.
        most_containers: containers considered a decision.
        most_types: missing types whose outcomes are told apart; the others count as not found.
        margin: an extra look must promise to save this much; V is an estimate, and the least of several
            estimates flatters.
    """

    base: Composed
    name: str = "scout-lios"
    most_containers: int = 5
    most_types: int = 3
    margin: float = 4.0

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return types_to_believe(task)

    def decide(self, view: View) -> Decision:
        made = self.base.decide(view)
        if made.plan.status is not PlanStatus.SOLVED or not made.plan.steps or prepares(view.task.goal):
            return made
        sought = _sought(made, view)
        if not sought:
            return made
        now = made.plan.steps[0].action == "find" and bool(made.search_order)
        first = made.search_order[0].container if now else None
        values = {c: self._value(c, sought, view) for c in self._candidates(first, sought, made, view)}
        if not values:
            return made
        best = min(values, key=lambda c: (values[c], c))
        stay = values[first] if first is not None else made.plan.cost
        if best == first or values[best] >= stay - self.margin:
            return made
        if now:
            return replace(made, search_order=_to_the_front(best, made, view, sought))
        return replace(made, look_on_the_way=(LocationId(best),))

    def _candidates(
        self, first: ContainerId | None, sought: tuple[ItemType, ...], made: Decision, view: View
    ) -> list[ContainerId]:
        """The containers that promise most for the way there: chances of all sought types over the detour."""
        score = _chance_of_any(sought, view) / (1.0 + _detours(made, view))
        ranked = [view.belief.containers[int(i)] for i in np.argsort(-score, kind="stable")]
        chosen = ranked[: self.most_containers]
        if first is not None and first not in chosen:
            chosen.append(first)
        return chosen

    def _value(self, container: ContainerId, sought: tuple[ItemType, ...], view: View) -> float:
        """Q(c)."""
        place = LocationId(container)
        travel = view.knowledge.travel
        way = travel.metres[travel.index(view.knowledge.robot_at), travel.index(place)] + view.costs.search
        column = view.belief.containers.index(container)
        chances = {t: float(conditioned(view.belief, t)[column]) for t in sought}
        told = sorted(sought, key=lambda t: (-chances[t], t))[: self.most_types]
        total = float(way)
        for found in product((False, True), repeat=len(told)):
            probability = float(
                np.prod([chances[t] if f else 1 - chances[t] for t, f in zip(told, found, strict=True)])
            )
            if probability < 1e-3:
                continue
            items = tuple(Item(id=ItemId(f"{t}|scouted"), type=t) for t, f in zip(told, found, strict=True) if f)
            total += probability * self._after(container, items, view)
        return total

    def _after(self, container: ContainerId, items: tuple[Item, ...], view: View) -> float:
        """V: what the base strategy's plan costs after the look."""
        held = view.knowledge.items_at.get(LocationId(container), ())
        knowledge = view.knowledge.moved(LocationId(container)).seen(container, (*items, *held))
        belief = _without(view.belief, container)
        later = replace(view, knowledge=knowledge, belief=belief)
        problem = problem_at(later, self.base.pricing, find_known=self.base.find_known)
        goal, find_known = view.task.goal, self.base.find_known
        if isinstance(goal, Holding):
            plan = plan_single_find(goal, knowledge, problem.find_costs, view.costs, find_known=find_known)
        else:
            plan = solve(problem, budget_s=view.budget_s, polish_nodes=0).plan
        return plan.cost if plan.status is PlanStatus.SOLVED else view.task.failure_cost


def _detours(made: Decision, view: View) -> npt.NDArray[np.float64]:
    """How much longer the next leg gets by way of each unsearched container, metres."""
    travel, here = view.knowledge.travel, view.knowledge.robot_at
    leg = next((step for step in made.plan.steps if step.action in ("move", "find")), None)
    onward = here if leg is None else leg.target
    if leg is not None and leg.action == "find" and made.search_order:
        onward = LocationId(made.search_order[0].container)
    a, b = travel.index(here), travel.index(onward)
    columns = np.array([travel.index(LocationId(c)) for c in view.belief.containers], dtype=np.intp)
    return travel.metres[a, columns] + travel.metres[columns, b] - travel.metres[a, b]


def _chance_of_any(sought: tuple[ItemType, ...], view: View) -> npt.NDArray[np.float64]:
    """The expected number of sought types in each unsearched container."""
    chance = np.zeros(len(view.belief.containers))
    for item_type in sought:
        chance = chance + conditioned(view.belief, item_type)
    return chance


def conditioned(belief: Belief, item_type: ItemType) -> npt.NDArray[np.float64]:
    """The chance of each container, given that an instance is in at least one."""
    p = belief.of(item_type)
    anywhere = 1.0 - float(np.prod(1.0 - p))
    return p / anywhere if anywhere > 0 else p


def _without(belief: Belief, container: ContainerId) -> Belief:
    keep = [i for i, c in enumerate(belief.containers) if c != container]
    return replace(
        belief,
        containers=tuple(belief.containers[i] for i in keep),
        probability=belief.probability[:, keep],
    )


def _sought(made: Decision, view: View) -> tuple[ItemType, ...]:
    """The types that the plan still has to find."""
    types = {step.item_types[0] for step in made.plan.steps if step.action == "find"}
    return tuple(sorted(types & set(view.belief.item_types)))


def _to_the_front(
    container: ContainerId, made: Decision, view: View, sought: tuple[ItemType, ...]
) -> tuple[SearchStop, ...]:
    column = view.belief.containers.index(container)
    item_type = next(step.item_types[0] for step in made.plan.steps if step.action == "find")
    leg = view.knowledge.travel.between(view.knowledge.robot_at, LocationId(container)) or 0.0
    chance = min(float(conditioned(view.belief, item_type)[column]), 1.0)
    stop = SearchStop(container=container, probability=chance, reached=1.0, leg_m=leg)
    rest = tuple(other for other in made.search_order if other.container != container)
    return (stop, *(replace(other, reached=other.reached * (1 - chance)) for other in rest))
