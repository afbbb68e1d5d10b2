"""Segments of a built-in strategy's runs over a plain log: looks, fetches and deliveries, without events.

The closed loop (workbench/execution/loop.py) tells all that happens: events with stamps, ways and reasons. A tree of
runs needs only what a segment costs, where it ends and what is known there, and that in a fraction of the time.
Whatever is out of the ordinary (no plan, a step that is not legal, the step limit) is left to the closed loop; tests
compare the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import final

from replayers.counterfactual.decisions.decided import Asked, Decided, Unasked
from replayers.counterfactual.decisions.memoized_strategy import DecisionBasis, MemoizedStrategy
from replayers.counterfactual.decisions.needed_items import NeededItems
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.tree.delivery_runs import CarriedOut, DeliveryRuns, delivery_runs
from workbench.beliefs.belief import Belief, Estimator
from workbench.beliefs.guarded_estimator import EstimatorFailed
from workbench.execution.estimator_queries import EstimatorQueries
from workbench.execution.goal_check import is_met
from workbench.planning.composed import Composed
from workbench.planning.plans import PlanStatus, PlanStep
from workbench.planning.strategy import Decision, Strategy, View
from workbench.worlds.house import ContainerId, Item, LocationId
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.perception import PERFECT


@dataclass(slots=True)
class QuickSegment:
    """A segment as far as it was followed.

    Attributes:
        knowledge: what the robot knows, at the end before the unobserved look.
        cost: without that look.
        steps, picks: how many actions and picks it takes, without that look.
        unobserved: the container of that look; None where the goal is met.
        decided: its decisions.
        placed: the steps that placed something.
    """

    knowledge: Knowledge
    cost: float
    steps: int
    picks: int
    unobserved: ContainerId | None
    decided: list[Decided]
    placed: list[PlanStep]


@final
class QuickRun:
    """Runs of one strategy over a plain log.

    Args:
        planner: a built-in strategy.
        made_of: where beliefs depend on nothing but the containers that are left, what the strategy is made of: then
            it is not asked for decisions of which it is known where they lead; None for asking it every time.
        needed: of items that still matter, which distinguish states; None where all do.
    """

    def __init__(
        self,
        evidence: Evidence,
        planner: Strategy,
        estimator: Estimator,
        made_of: Composed | None = None,
        needed: NeededItems | None = None,
        *,
        seed: int,
    ) -> None:
        self._evidence = evidence
        self._planner = planner
        self._task = evidence.task
        self._types = planner.relevant_types(evidence.task)
        self._queries = EstimatorQueries(estimator, evidence.task, PERFECT)
        self._seed = seed
        self._deliveries: DeliveryRuns | None = None
        if made_of is not None:
            self._deliveries = delivery_runs(evidence, made_of, self._belief, needed)

    def segment(self, knowledge: Knowledge, *, steps_left: int) -> QuickSegment | None:
        """From a state to the next unobserved look or to the goal; None where the closed loop has to run it."""
        made = QuickSegment(knowledge, 0.0, 0, 0, None, [], [])
        try:
            while made.unobserved is None:
                unasked = self._deliveries.carry_out(made.knowledge, made.cost) if self._deliveries else None
                if unasked is not None:
                    if not self._was_carried_out(unasked, made, steps_left):
                        return None
                    if unasked.look is None:
                        break
                elif is_met(self._task.goal, made.knowledge):
                    break
                elif not self._was_asked(made, steps_left):
                    return None
        except EstimatorFailed:
            return None
        return made

    def _belief(self, knowledge: Knowledge) -> Belief:
        return self._queries.belief(knowledge, self._types)

    def _asked(self, knowledge: Knowledge) -> tuple[DecisionBasis | None, Decision]:
        """What the planner decides, and by what."""
        view = View(
            knowledge=knowledge,
            belief=self._belief(knowledge),
            task=self._task,
            costs=self._evidence.costs,
            budget_s=self._task.budget_s,
            seed=self._seed,
            perception=PERFECT,
        )
        decision = self._planner.decide(view)
        return self._planner.basis if isinstance(self._planner, MemoizedStrategy) else None, decision

    def _was_asked(self, made: QuickSegment, steps_left: int) -> bool:
        """Carries out what the planner decides; whether all went as it should."""
        basis, decision = self._asked(made.knowledge)
        made.decided.append(Asked(basis, decision))
        solved = decision.plan.status is PlanStatus.SOLVED and bool(decision.plan.steps)
        return solved and self._carried_out(decision, made, steps_left)

    def _was_carried_out(self, unasked: CarriedOut, made: QuickSegment, steps_left: int) -> bool:
        """Takes over a decision that was carried out up to a look; whether all went as it should."""
        assert self._deliveries is not None, "it carried them out"
        if not unasked.acts and unasked.look is None:
            return True
        knowledge = made.knowledge
        ask, tell = partial(self._asked, knowledge), partial(self._deliveries.steps_of, knowledge, unasked.acts)
        made.decided.append(Unasked(knowledge, unasked.look, ask=ask, tell=tell))
        made.knowledge, made.cost = unasked.knowledge, unasked.cost
        made.steps += len(unasked.acts)
        made.picks += unasked.picks
        return (unasked.look is None or self._look(unasked.look, made)) and made.steps < steps_left

    def _carried_out(self, decision: Decision, made: QuickSegment, steps_left: int) -> bool:
        """Carries a plan out up to a look or to its end; whether all went as it should."""
        if decision.look_on_the_way:
            return self._look(ContainerId(decision.look_on_the_way[0]), made) and made.steps < steps_left
        for step in decision.plan.steps[: decision.steps_now]:
            if step.origin != made.knowledge.robot_at:
                return False
            if step.action == "find":
                if made.knowledge.holding is not None or not decision.search_order:
                    return False
                return self._look(decision.search_order[0].container, made) and made.steps < steps_left
            if not self._act(step, made) or made.steps >= steps_left:
                return False
        return True

    def _look(self, container: ContainerId, made: QuickSegment) -> bool:
        place, known = LocationId(container), made.knowledge
        if container not in known.unsearched:
            return False
        if known.robot_at != place and not self._walk(place, made):
            return False
        inside = self._evidence.contents.get(container)
        if inside is None:
            made.unobserved = container
            return True
        known, ids = made.knowledge, {item.id for item in inside}
        put = known.items_at.get(place, ())
        made.knowledge = known.seen(container, (*inside, *(item for item in put if item.id not in ids)))
        made.cost += self._evidence.costs.search
        made.steps += 1
        return True

    def _act(self, step: PlanStep, made: QuickSegment) -> bool:
        known = made.knowledge
        if step.action == "move":
            return self._walk(step.target, made)
        if step.action == "pick":
            item = _item_here(known, step)
            if item is None or known.holding is not None:
                return False
            made.knowledge = known.picked(item)
            made.picks += 1
        elif step.action == "place":
            if known.holding is None or step.items != (known.holding.id,):
                return False
            made.knowledge = known.placed()
            made.placed.append(step)
        else:
            return False
        made.cost += self._evidence.costs.manipulation
        made.steps += 1
        return True

    def _walk(self, place: LocationId, made: QuickSegment) -> bool:
        metres = self._evidence.travel.between(made.knowledge.robot_at, place)
        if metres is None:
            return False
        made.knowledge = made.knowledge.moved(place)
        made.cost += metres
        made.steps += 1
        return True


def _item_here(knowledge: Knowledge, step: PlanStep) -> Item | None:
    """The item of a pick, where the robot stands."""
    here = knowledge.items_at.get(knowledge.robot_at, ())
    return next((item for item in here if step.items == (item.id,)), None)
