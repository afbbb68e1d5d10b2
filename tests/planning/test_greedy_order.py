"""Many deliveries: there is always a plan, one errand after the other, and it is a good one."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from problems import deliver_goal, random_problem

from workbench.planning.builtin.attempts import attempts_of, sequential_plan
from workbench.planning.builtin.greedy_order import errand_order
from workbench.planning.builtin.solver import _SearchState, solve
from workbench.planning.plans import PlanStatus
from workbench.planning.problem import Problem, apply, holds, initial_state
from workbench.planning.scenarios.paper import make_task
from workbench.planning.tasks import AllOf


def legs(points: list[tuple[int, int]]) -> np.ndarray:
    """Errands that end where they begin, the first point being the start."""
    at = np.array(points, dtype=float)
    metres = np.abs(at[:, None] - at[None, :]).sum(axis=2)
    return metres[:, 1:]


def test_an_order_by_hand() -> None:
    """On a line, from 0: one step left, then right to the end; nearest first would do the same."""
    cost, order = errand_order(legs([(0, 0), (3, 0), (-1, 0), (7, 0)]))
    assert (cost, order) == (9.0, (1, 0, 2))


def test_nearest_first_is_mended() -> None:
    """Nearest first goes right, left, right again: 2 + 5 + 13 = 20. Left first costs 3 + 5 + 8 = 16."""
    cost, order = errand_order(legs([(0, 0), (2, 0), (-3, 0), (10, 0)]))
    assert (cost, order) == (16.0, (1, 0, 2))


def test_nothing_to_do_costs_nothing() -> None:
    assert errand_order(np.zeros((1, 0))) == (0.0, ())


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=2, max_size=6))
def test_an_order_is_whole_and_costs_what_it_says(points: list[tuple[int, int]]) -> None:
    leg = legs(points)
    cost, order = errand_order(leg)
    tried = [_walked(leg, other) for other in permutations(range(leg.shape[1]))]
    assert sorted(order) == list(range(leg.shape[1]))
    assert cost == pytest.approx(_walked(leg, order))
    assert min(tried) - 1e-9 <= cost <= max(tried) + 1e-9


def _walked(leg: np.ndarray, order: tuple[int, ...]) -> float:
    return float(sum(leg[row, j] for row, j in zip((0, *(1 + i for i in order)), order, strict=False)))


@pytest.mark.ci_but(3)
@pytest.mark.parametrize("things", [15, 30, 45])
@pytest.mark.parametrize("seed", range(3))
def test_there_is_a_plan_however_many_things(things: int, seed: int) -> None:
    types = tuple(f"Thing{i:02d}" for i in range(things))
    case = random_problem(deliver_goal(*types), types, seed=seed, places=25)
    plan = solve(case, budget_s=60).plan
    assert plan.status is PlanStatus.SOLVED
    assert plan.lower_bound is not None
    assert plan.lower_bound <= plan.cost
    assert meets_the_goal(case, plan.steps)


@pytest.mark.parametrize("seed", range(12))
def test_errand_after_errand_is_a_plan_near_the_best(seed: int) -> None:
    types = ("Mug", "Egg", "Book", "Bowl")
    case = random_problem(deliver_goal(*types), types, seed=seed, places=6)
    best = solve(case).plan
    tried = [sequential_plan(case, attempt) for attempt in attempts_of(case)[0]]
    costs = [made[0] for made in tried if made is not None]
    assert best.cost - 1e-6 <= min(costs) <= 1.5 * best.cost + 1e-6


def meets_the_goal(case: Problem, steps: object) -> bool:
    state = initial_state(case)
    for step in steps:  # type: ignore[attr-defined]
        state = apply(step, state)
    return holds(case.goal, state, case)


def test_a_scenario_asks_for_as_many_things_as_the_house_has() -> None:
    from workbench.worlds.procthor.load import load_house
    from workbench.worlds.shipped import shipped_houses

    goal = make_task("deliver-20", load_house(f"{shipped_houses()}:0"), seed=0).goal
    assert isinstance(goal, AllOf)
    assert len(goal.parts) == 20


def test_a_plan_is_not_made_better_with_all_of_the_time_that_is_left() -> None:
    """A second passes at every look at the clock: with a plan in hand, a tenth of the budget is enough."""
    types = tuple(f"Thing{i:02d}" for i in range(12))
    case = random_problem(deliver_goal(*types), types, seed=1, places=12)
    now = [0.0]

    def clock() -> float:
        now[0] += 1.0
        return now[0]

    run = _SearchState(problem=case, deadline=100.0, enough=10.0, clock=clock, given=float("inf"))
    now[0] = 50.0
    assert not run.is_late(), "without a plan all of it"
    run.sequential_plan(attempts_of(case)[0][0])
    assert run.best is not None
    assert run.is_late()
