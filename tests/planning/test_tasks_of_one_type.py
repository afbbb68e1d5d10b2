"""Goals that ask for many items of one type: plans of the same quality, in bounded time."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problems import COSTS, grid_place, random_problem, thing

from workbench.errors import BadValue
from workbench.planning.builtin.recipes import recipes_of
from workbench.planning.builtin.solver import solve
from workbench.planning.matching import has_perfect_matching
from workbench.planning.plans import PlanStatus
from workbench.planning.problem import Problem, problem_of
from workbench.planning.solvers.fast_downward import FastDownward
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Task, count_alternatives
from workbench.worlds.house import ItemType, LocationId
from workbench.worlds.knowledge import knowledge_at_start

MUG = ItemType("Mug")


def mugs(*places: str) -> AllOf:
    return AllOf(parts=tuple(Delivered(item_type=MUG, at=LocationId(at)) for at in places))


def problem_with(known: int, goal: Goal, *, places: int = 6) -> Problem:
    """Mugs known all over a grid, searched through and through."""
    plan, travel = grid_place(np.array([(i, 2 * i % 7) for i in range(places)]))
    knowledge = knowledge_at_start(plan, travel, {})
    boxes = [c.id for c in plan.containers]
    for b, box in enumerate(boxes):
        knowledge = knowledge.seen(box, tuple(thing("Mug", n) for n in range(b, known, len(boxes))))
    return problem_of(goal, knowledge, COSTS, locations=travel.locations, find_costs=None)


@given(st.lists(st.lists(st.integers(0, 4), unique=True, max_size=4), max_size=5))
def test_each_has_its_own_as_trying_all_says(choices: list[list[int]]) -> None:
    tried = any(all(c in choices[i] for i, c in enumerate(chosen)) for chosen in permutations(range(5), len(choices)))
    assert has_perfect_matching(choices) is tried


@pytest.mark.parametrize("seed", range(6))
def test_equal_wants_cost_what_blind_search_says(seed: int) -> None:
    """Known ones, and ones that are all to be found."""

    def goal(rng: np.random.Generator, locations: tuple[LocationId, ...]) -> Goal:
        return mugs(locations[1], locations[1], locations[2])

    cases = [problem_with(3 + seed % 3, mugs("Shelf|0", "Shelf|0", f"Shelf|{1 + seed % 4}"), places=5)]
    cases.append(random_problem(goal, ("Mug",), seed=seed, places=5, known_share=0.2))
    for case in cases:
        ours, theirs = solve(case).plan, FastDownward(search="blind").solve(case, budget_s=60).plan
        assert ours.status is theirs.status
        assert ours.cost == pytest.approx(theirs.cost)


def test_equal_wants_take_their_things_in_one_order() -> None:
    """Of five mugs, two to one place and one to another: 5 choose 2, times the three that are left."""
    assert len(recipes_of(problem_with(5, mugs("Shelf|0", "Shelf|0", "Shelf|1")))) == 10 * 3


def test_forty_equal_wants_are_planned_for_or_given_up_at_once() -> None:
    wants = mugs(*["Shelf|0"] * 40)
    lacking = solve(problem_with(39, wants), budget_s=5.0).plan
    assert lacking.status is PlanStatus.NO_PLAN
    enough = solve(problem_with(40, wants), budget_s=5.0).plan
    assert enough.status is PlanStatus.SOLVED
    assert sum(step.action == "place" for step in enough.steps) == 40 - 8


def test_many_wants_at_different_places_end_with_the_budget() -> None:
    """Each reading of the clock is a second: what is sought, and how long, is the budget's business."""
    ticks = iter(range(10_000))
    wants = mugs(*[f"Shelf|{i % 4 + 4}" for i in range(12)])
    made = solve(problem_with(20, wants, places=9), budget_s=20.0, clock=lambda: float(next(ticks))).plan
    assert next(ticks) < 40
    assert made.status in (PlanStatus.SOLVED, PlanStatus.TIMED_OUT)
    assert not made.optimal


def test_more_alternatives_than_can_be_planned_for_are_refused() -> None:
    either = AnyOf(parts=(Delivered(item_type=MUG, at=LocationId("a")), Delivered(item_type=MUG, at=LocationId("b"))))
    assert count_alternatives(AllOf(parts=(either,) * 12)) == 4096
    with pytest.raises(BadValue, match="ways to meet the goal of tea"):
        Task(scenario="tea", goal=AllOf(parts=(either,) * 40), failure_cost=400.0, budget_s=60.0)
