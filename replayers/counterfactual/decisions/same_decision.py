"""Whether a decision is the same whatever else the open containers on the way held.

An estimator that learns from all that is seen would believe something else had an open container held a vase besides
the mug. Where it can say which beliefs are possible (`FollowsContents`), the strategy is asked again with each. If it
always does the same next, the run is followed like one whose beliefs are certain.

Why that is right. What a strategy may read: of what is known, where the task's item types are (the contract of
docs/replay.md), which no other contents change; and its belief, which they do. In another world that a run has in
common up to here, let the open containers that it looked into hold something else besides.

1. The strategy was seen to read some rows of its belief and no others (watched_belief.py), each about a type that
   still matters: of these types the containers hold nothing but what is known, since their answers counted them. So
   the estimator's promise covers all these rows together: among its beliefs is one that has them as they would be in
   the other world. A strategy that reads a row about a type that no longer matters is not asked: of that type, the
   containers may hold anything.
2. Asked with that belief, it read no row but these (it is watched again each time). It is deterministic, so that with
   the belief of the other world, which may differ in rows that it does not read, it decides alike.

So the run goes the same way in the other world up to its next look. A decision that read no row is the same anywhere.

Beliefs about several types multiply. Where plans go by the find costs of each type, those by all beliefs about one
type are bounded, and one judgement of the plan within these bounds (certain_plan.py) stands for asking with each
combination; where it says nothing, the bounds are parted (price_boxes.py).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Protocol, final, runtime_checkable

import numpy as np

from replayers.counterfactual.decisions.certain_plan import begins_alike, can_be_judged
from replayers.counterfactual.decisions.memoized_strategy import DecisionBasis
from replayers.counterfactual.decisions.price_boxes import begins_alike_in_all
from replayers.counterfactual.decisions.watched_belief import Read, decide_watched
from workbench.arrays import Floats, Ints
from workbench.beliefs.after_looks import after_looks
from workbench.beliefs.belief import Belief, Estimator
from workbench.planning.actions import prepares
from workbench.planning.composed import Composed
from workbench.planning.find_pricing import FindCostRequest, FindPricing
from workbench.planning.plans import PlanStatus, PlanStep
from workbench.planning.scenarios.added_items import believe_scenario_items
from workbench.planning.strategy import Decision, Strategy, View
from workbench.search.find_costs import FindCosts
from workbench.search.policy import SearchPolicy, SearchQuery
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.knowledge import Knowledge

MAX_BELIEFS, MAX_ROWS, MAX_PRICED = 400, 30_000, 4_000
"""At most so many beliefs with which a strategy is asked again for one decision, and a policy where it looks first,
and by which finds of one type are priced."""


@runtime_checkable
class FollowsContents(Protocol):
    """An estimator that learns from everything seen, and can say how far other contents would lead it."""

    def beliefs_whatever_else(
        self,
        knowledge: Knowledge,
        item_types: tuple[ItemType, ...],
        partly_known: Collection[ContainerId],
        *,
        at_most: int,
    ) -> tuple[Belief, ...] | None:
        """Every belief that other items in some searched containers can lead to; None where there are too many.

        How many items of one type a container holds, if any, must change no belief (another_instance.py).
        """
        ...


@runtime_checkable
class LooksFirst(Protocol):
    """A policy that says for many beliefs at once where it looks first."""

    def firsts(self, query: SearchQuery, rows: Floats) -> frozenset[ContainerId]:
        """Where it looks first with each of many rows of probabilities in place of the query's."""
        ...


@final
class SameDecision:
    """The test for one strategy and one estimator.

    Args:
        unopened: the containers that nobody opened.
        settled: the item types of which containers that were looked into hold nothing but what is known.
        policy: of a strategy whose plans do not depend on beliefs: what decides where it looks.
        parts: of a strategy whose plans go by find costs of each type alone (strategy_traits.eq1_parts): what it is
            made of.
        at_most: how often the strategy is asked again, over all decisions.
    """

    def __init__(
        self,
        strategy: Strategy,
        estimator: Estimator,
        unopened: Collection[ContainerId],
        settled: Callable[[Knowledge], tuple[ItemType, ...]],
        *,
        policy: SearchPolicy | None,
        parts: Composed | None,
        at_most: int,
    ) -> None:
        self._strategy = strategy
        self._estimator = estimator if isinstance(estimator, FollowsContents) else None
        self._unopened = frozenset(unopened)
        self._settled = settled
        self._left = at_most
        self._policy = policy if isinstance(policy, LooksFirst) else None
        self._parts = parts

    def holds(self, basis: DecisionBasis, made: Decision) -> bool:
        """Whether the strategy does the same next whatever else the open containers held that it looked into.

        Args:
            basis: what it decided by if they held nothing else.
            made: what it decided.
        """
        view, knowledge = basis.view, basis.view.knowledge
        if self._estimator is None or prepares(view.task.goal):
            return False
        partly_known = [c for c in knowledge.first_seen if c in self._unopened]
        if not partly_known or not basis.read:
            return True
        if not set(basis.read) <= set(self._settled(knowledge)):
            return False
        if not view.task.added and view.perception.perfect:
            if self._policy is not None:
                return self._always_looks(view, made, partly_known, self._policy)
            if self._parts is not None:
                same = self._always_begins(basis, made, partly_known, self._parts)
                if same is not None:
                    return same
        return self._always_decides(view, basis.read, made, partly_known)

    def _always_decides(self, view: View, read: Read, made: Decision, partly_known: Collection[ContainerId]) -> bool:
        """Whether the strategy does the same next with every belief that other contents lead to."""
        assert self._estimator is not None, "asked of estimators that follow contents"
        beliefs = self._estimator.beliefs_whatever_else(
            view.knowledge, read, partly_known, at_most=min(MAX_BELIEFS, self._left)
        )
        if beliefs is None:
            return False
        expected = next_steps(made)
        for belief in reversed(beliefs):  # the last is the farthest from what was believed
            again, also_read = self._again(view, belief)
            if next_steps(again) != expected or not set(also_read) <= set(read):
                return False
        return True

    def _always_begins(
        self, basis: DecisionBasis, made: Decision, partly_known: Collection[ContainerId], parts: Composed
    ) -> bool | None:
        """Whether the plan begins alike, and its first look is the same, with every belief that other contents lead
        to; by bounds of its find costs. None where these say nothing."""
        view, problem, policy = basis.view, parts.problem(basis.view), parts.policy
        costs = problem.find_costs
        if costs is None or not isinstance(policy, LooksFirst) or not can_be_judged(problem, made.plan):
            return None
        if self._left <= 0 or not set(costs.item_types) <= set(basis.read):
            return None
        rows = [self._rows(view, item_type, partly_known) for item_type in costs.item_types]
        rows = [each for each in rows if each is not None and len(each) <= MAX_PRICED]
        if len(rows) < len(costs.item_types):
            return None
        if not _looks_there(view, made, policy, dict(zip(costs.item_types, rows, strict=True))):
            return False
        prices = [_priced(each, view, parts.pricing, costs) for each in rows]
        least, most = (np.stack([of(each, axis=0) for each in prices]) for of in (np.min, np.max))
        self._left -= 1
        if begins_alike(problem, made.plan, least, most):
            return True
        which = self._combinations(view, costs.item_types, partly_known, rows)
        if which is None:
            return None

        def decides_so(part: Ints) -> bool:
            probability = np.stack([of[k] for of, k in zip(rows, part, strict=True)])
            again, read = self._again(
                view, replace(view.belief, item_types=costs.item_types, probability=probability)
            )
            return next_steps(again) == next_steps(made) and set(read) <= set(costs.item_types)

        same, judged = begins_alike_in_all(problem, made.plan, prices, which, decides_so, at_most=self._left)
        self._left -= judged
        return same

    def _again(self, view: View, belief: Belief) -> tuple[Decision, Read]:
        """What the strategy decides with a belief about some types in place of its own, and what it reads."""
        self._left -= 1
        return decide_watched(self._strategy, _with(view, belief))

    def _combinations(
        self,
        view: View,
        item_types: Read,
        partly_known: Collection[ContainerId],
        rows: Sequence[Floats],
    ) -> Ints | None:
        """Which rows of several types may be believed together, shape (beliefs, types); None where there are too
        many."""
        assert self._estimator is not None, "asked of estimators that follow contents"
        beliefs = self._estimator.beliefs_whatever_else(view.knowledge, item_types, partly_known, at_most=MAX_ROWS)
        if beliefs is None:
            return None
        found = [{row.tobytes(): j for j, row in enumerate(of)} for of in rows]
        which = [[at.get(row.tobytes(), -1) for at, row in zip(found, b.probability, strict=True)] for b in beliefs]
        return None if any(-1 in each for each in which) else np.array(which)

    def _rows(self, view: View, item_type: ItemType, partly_known: Collection[ContainerId]) -> Floats | None:
        """What may be believed of one type, shape (beliefs, containers); None where that is too much."""
        assert self._estimator is not None, "asked of estimators that follow contents"
        beliefs = self._estimator.beliefs_whatever_else(view.knowledge, (item_type,), partly_known, at_most=MAX_ROWS)
        return None if beliefs is None else np.concatenate([belief.probability for belief in beliefs])

    def _always_looks(
        self, view: View, made: Decision, partly_known: Collection[ContainerId], policy: LooksFirst
    ) -> bool:
        """Whether the first find of a plan begins where it does with every belief that other contents lead to."""
        find = _first_find(made)
        if find is None or not made.search_order:
            return True
        if self._left <= 0:
            return False
        self._left -= 1
        rows = self._rows(view, find.item_types[0], partly_known)
        return rows is not None and _looks_there(view, made, policy, {find.item_types[0]: rows})


def _first_find(made: Decision) -> PlanStep | None:
    return next((step for step in made.plan.steps[: made.steps_now] if step.action == "find"), None)


def _looks_there(view: View, made: Decision, policy: LooksFirst, rows: Mapping[ItemType, Floats]) -> bool:
    """Whether the first find of a plan begins where it does by each of several beliefs.

    Args:
        rows: what may be believed of types, shape (beliefs, containers).
    """
    find = _first_find(made)
    if find is None or not made.search_order:
        return True
    query = SearchQuery(
        item_type=find.item_types[0],
        origin=find.origin,
        target=find.target,
        belief=view.belief.only(find.item_types[:1]),
        travel=view.knowledge.travel,
        costs=view.costs,
    )
    return policy.firsts(query, rows[find.item_types[0]]) == frozenset({made.search_order[0].container})


def _priced(rows: Floats, view: View, pricing: FindPricing, like: FindCosts) -> Floats:
    """The find costs by each of several beliefs about one type, shape (beliefs, origins, targets)."""
    names = tuple(ItemType(f"row {j}") for j in range(len(rows)))
    request = FindCostRequest(
        belief=replace(view.belief, item_types=names, probability=rows, p_detect=()),
        travel=view.knowledge.travel,
        origins=like.origins,
        targets=like.targets,
        costs=view.costs,
    )
    return pricing.price(request).metres


def _with(view: View, belief: Belief) -> View:
    """The view with a belief about some of its types in place of its own."""
    probability = view.belief.probability.copy()
    for item_type in belief.item_types:
        probability[view.belief.item_types.index(item_type)] = belief.of(item_type)
    believed = believe_scenario_items(
        replace(view.belief, probability=probability, p_detect=()), view.task, view.knowledge.plan
    )
    return replace(view, belief=after_looks(believed, view.knowledge, view.perception))


def next_steps(made: Decision) -> object:
    """What a robot does by a decision until it sees something new, or all of it."""
    plan, first = made.plan, made.search_order[0].container if made.search_order else None
    if plan.status is not PlanStatus.SOLVED:
        return plan.status
    if made.look_on_the_way:  # it looks there, then decides anew
        return made.look_on_the_way[:1]
    steps: list[object] = []
    for step in plan.steps[: made.steps_now]:
        if step.action == "find":
            return (*steps, step.item_types, first)
        steps.append((step.action, step.origin, step.target, step.item_types, step.items))
    return tuple(steps)
