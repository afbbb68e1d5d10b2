"""Whether a decision is the same whatever else the open containers on the way held.

An estimator that learns from all that is seen would believe something else had an open container held a vase besides
the mug. Where it can say which beliefs are possible (`FollowsContents`), the strategy is asked again with each. If it
always does the same next, the run is followed like one whose beliefs are certain.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Protocol, final, runtime_checkable

import numpy as np

from workbench.arrays import Floats
from workbench.beliefs.after_looks import after_looks
from workbench.beliefs.belief import Belief, Estimator
from workbench.planning.actions import prepares
from workbench.planning.plans import PlanStatus
from workbench.planning.problem import missing_types
from workbench.planning.scenarios.added_items import believe_scenario_items
from workbench.planning.strategy import Decision, Strategy, View
from workbench.search.policy import SearchPolicy, SearchQuery
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.knowledge import Knowledge

MAX_BELIEFS, MAX_ROWS = 400, 10_000
"""Beliefs with which a strategy is asked again for one decision, and a policy where it looks first, at most."""


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
        """Every belief that other items in some searched containers can lead to; None where there are too many."""
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
        strategy: one that uses beliefs about types that are missing, and about no others
            (strategy_traits.believes_missing_only).
        unopened: the containers that nobody opened.
        policy: of a strategy whose plans do not depend on beliefs: what decides where it looks.
        at_most: how often the strategy is asked again, over all decisions.
    """

    def __init__(
        self,
        strategy: Strategy,
        estimator: Estimator,
        unopened: Collection[ContainerId],
        *,
        policy: SearchPolicy | None,
        at_most: int,
    ) -> None:
        self._strategy = strategy
        self._estimator = estimator if isinstance(estimator, FollowsContents) else None
        self._unopened = frozenset(unopened)
        self._left = at_most
        self._policy = policy if isinstance(policy, LooksFirst) else None

    def holds(self, view: View, made: Decision) -> bool:
        """Whether the strategy does the same next whatever else the open containers held that it looked into.

        Args:
            made: its decision if they held nothing else.
        """
        if self._estimator is None or prepares(view.task.goal):
            return False
        knowledge = view.knowledge
        partly_known = [c for c in knowledge.first_seen if c in self._unopened]
        types = missing_types(view.task.goal, knowledge, view.task.available)
        if not partly_known or not types:
            return True
        types = tuple(t for t in types if t in view.belief.item_types)
        if self._policy is not None and not view.task.added and view.perception.perfect:
            return self._looks_there(view, made, partly_known, self._policy)
        beliefs = self._estimator.beliefs_whatever_else(
            knowledge, types, partly_known, at_most=min(MAX_BELIEFS, self._left)
        )
        if beliefs is None:
            return False
        expected = next_steps(made)
        for belief in reversed(beliefs):  # the last is the farthest from what was believed
            self._left -= 1
            if next_steps(self._strategy.decide(_with(view, belief))) != expected:
                return False
        return True

    def _looks_there(
        self, view: View, made: Decision, partly_known: Collection[ContainerId], policy: LooksFirst
    ) -> bool:
        """Whether the first find of a plan begins where it does whatever else the open containers held."""
        find = next((step for step in made.plan.steps[: made.steps_now] if step.action == "find"), None)
        if find is None or not made.search_order:
            return True
        assert self._estimator is not None, "asked of estimators that follow contents"
        if self._left <= 0:
            return False
        self._left -= 1
        beliefs = self._estimator.beliefs_whatever_else(
            view.knowledge, find.item_types[:1], partly_known, at_most=MAX_ROWS
        )
        if beliefs is None:
            return False
        query = SearchQuery(
            item_type=find.item_types[0],
            origin=find.origin,
            target=find.target,
            belief=beliefs[0],
            travel=view.knowledge.travel,
            costs=view.costs,
        )
        rows = np.concatenate([belief.probability for belief in beliefs])
        return policy.firsts(query, rows) == frozenset({made.search_order[0].container})


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
    steps: list[object] = []
    for step in plan.steps[: made.steps_now]:
        steps.append((step.action, step.origin, step.target, step.item_types, step.items))
        if step.action == "find":
            return made.look_on_the_way[:1], (*steps[:-1], step.item_types, first)
    return made.look_on_the_way[:1], tuple(steps)
