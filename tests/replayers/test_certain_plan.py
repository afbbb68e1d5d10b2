"""A plan that is said to begin alike at all find costs within bounds does so with every belief that leads to them."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial
from itertools import product

import numpy as np
import pytest

from recorders.simulated_run import RequestedTask, trial_events, trial_for
from replayers.counterfactual.decisions.certain_plan import begins_alike, can_be_judged
from replayers.counterfactual.decisions.price_boxes import begins_alike_in_all
from replayers.counterfactual.strategy_traits import eq1_parts
from workbench.arrays import Floats, Ints
from workbench.planning.composed import Composed
from workbench.planning.find_pricing import FindCostRequest
from workbench.planning.plans import Plan
from workbench.planning.problem import Problem
from workbench.planning.strategies import strategy
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import Task
from workbench.worlds.house import ItemType
from workbench.worlds.procthor.load import load_houses
from workbench.worlds.shipped import shipped_houses

BELIEFS = 3
"""About each type that is missing."""


class KeepingViews:
    """A composed strategy that keeps its views with what it decided."""

    def __init__(self, parts: Composed) -> None:
        self.name, self.parts = parts.name, parts
        self.made: list[tuple[View, Decision]] = []

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return self.parts.relevant_types(task)

    def decide(self, view: View) -> Decision:
        self.made.append((view, self.parts.decide(view)))
        return self.made[-1][1]


@lru_cache
def judged(name: str) -> tuple[Composed, list[tuple[View, Problem, Plan]]]:
    """The decisions of a strategy that can be judged, in deliveries of three over shipped houses."""
    parts = eq1_parts(strategy(name))
    assert parts is not None
    found: list[tuple[View, Problem, Plan]] = []
    for number in (9, 7):
        keeping = KeepingViews(parts)
        house = load_houses(shipped_houses())[number]
        list(trial_events(trial_for(RequestedTask(scenario="deliver-3"), house, strategy=keeping, estimator="best")))
        decided = [(view, parts.problem(view), made.plan) for view, made in keeping.made]
        found += [(view, problem, plan) for view, problem, plan in decided if can_be_judged(problem, plan)]
    return parts, found


def beginning(plan: Plan) -> list[tuple[object, ...]]:
    """The steps of a plan up to its first find, and that."""
    steps = [(step.action, step.origin, step.target, step.item_types, step.items) for step in plan.steps]
    return steps[: [step.action for step in plan.steps].index("find") + 1]


def other_beliefs(view: View, problem: Problem, spread: float, rng: np.random.Generator) -> list[Floats]:
    """Beliefs about each type that is missing, its own first, shape (beliefs, containers)."""
    assert problem.find_costs is not None
    known = [view.belief.of(t) for t in problem.find_costs.item_types]
    factors = np.exp(spread * rng.normal(size=(len(known), BELIEFS, len(view.belief.containers))))
    factors[:, 0] = 1.0
    return [np.clip(p * factor, 0.0, 1.0) for p, factor in zip(known, factors, strict=True)]


def priced(parts: Composed, view: View, problem: Problem, rows: Floats) -> Floats:
    costs = problem.find_costs
    assert costs is not None
    names = tuple(ItemType(f"row {k}") for k in range(len(rows)))
    belief = replace(view.belief, item_types=names, probability=rows)
    request = FindCostRequest(
        belief=belief, travel=problem.travel, origins=costs.origins, targets=costs.targets, costs=view.costs
    )
    return parts.pricing.price(request).metres


def decided(parts: Composed, view: View, problem: Problem, rows: list[Floats], part: tuple[int, ...]) -> Plan:
    assert problem.find_costs is not None
    probability = view.belief.probability.copy()
    for item_type, of, k in zip(problem.find_costs.item_types, rows, part, strict=True):
        probability[view.belief.item_types.index(item_type)] = of[k]
    return parts.decide(replace(view, belief=replace(view.belief, probability=probability))).plan


@pytest.mark.parametrize("name", ["model-lios", "conditioned-lios"])
def test_plans_begin_alike_where_bounds_of_find_costs_say_so(name: str) -> None:
    parts, views = judged(name)
    rng, said, denied, brings_first = np.random.default_rng(1), 0, 0, 0
    for (view, problem, plan), spread in product(views, (0.05, 0.8)):
        rows = other_beliefs(view, problem, spread, rng)
        prices = [priced(parts, view, problem, of) for of in rows]
        least, most = (np.stack([bound(of, axis=0) for of in prices]) for bound in (np.min, np.max))
        if not begins_alike(problem, plan, least, most):
            denied += 1
            continue
        said += 1
        brings_first += plan.steps[0].action != "find"
        for part in product(range(BELIEFS), repeat=len(rows)):
            assert beginning(decided(parts, view, problem, rows, part)) == beginning(plan)
    assert said > 5
    assert brings_first
    assert denied


def begins_so(parts: Composed, view: View, problem: Problem, plan: Plan, rows: list[Floats], part: Ints) -> bool:
    return beginning(decided(parts, view, problem, rows, tuple(part.tolist()))) == beginning(plan)


@pytest.mark.parametrize("name", ["model-lios"])
def test_parted_bounds_say_what_asking_with_each_belief_says(name: str) -> None:
    parts, views = judged(name)
    rng, answers, fewer = np.random.default_rng(2), set[bool](), 0
    for (view, problem, plan), spread in product(views, (0.1, 0.8)):
        rows = other_beliefs(view, problem, spread, rng)
        prices = [priced(parts, view, problem, of) for of in rows]
        which = np.array(list(product(range(BELIEFS), repeat=len(rows))))

        decides_so = partial(begins_so, parts, view, problem, plan, rows)
        same, count = begins_alike_in_all(problem, plan, prices, which, decides_so, at_most=1000)
        assert same == all(decides_so(part) for part in which)
        assert begins_alike_in_all(problem, plan, prices, which, decides_so, at_most=0) == (False, 0)
        answers.add(same)
        fewer += same and count < len(which)
    assert answers == {True, False}
    assert fewer


def test_only_plans_whose_beginnings_are_known_are_judged() -> None:
    _, views = judged("model-lios")
    view, problem, plan = views[0]
    assert not can_be_judged(problem, replace(plan, optimal=False))
    assert not can_be_judged(problem, replace(plan, steps=()))
    assert not can_be_judged(replace(problem, find_costs=None), plan)
    held = tuple(replace(thing, held=True, at=None) for thing in problem.things)
    assert not can_be_judged(replace(problem, things=held), plan)
    assert eq1_parts(strategy("model-lios-per-find")) is None
    assert eq1_parts(strategy("full-lios")) is None
    assert eq1_parts(strategy("scout-lios")) is None
    assert view.task.goal == problem.goal
