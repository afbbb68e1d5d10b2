"""Plain deliveries are solved as by the general search: the same steps, costs and bounds to the last bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import COSTS, any_goal, breakfast_goal, deliver_goal, grid_place, holding_goal, random_problem, thing

from workbench.planning.builtin import solver
from workbench.planning.builtin.deliveries import delivery_steps
from workbench.planning.builtin.solver import POLISH_NODES, SolverResult, solve
from workbench.planning.problem import Problem, problem_of
from workbench.planning.tasks import AllOf, Delivered
from workbench.search.costs import ActionCosts
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import knowledge_at_start

THREE = ("Mug", "Book", "Pen")


def not_asked(problem: Problem, *, polish_nodes: int) -> None:
    return


def generally(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> SolverResult:
    with monkeypatch.context() as patched:
        patched.setattr(solver, "delivery_steps", not_asked)
        return solve(problem)


def is_quick(problem: Problem) -> bool:
    return delivery_steps(problem, polish_nodes=POLISH_NODES) is not None


def unequal(problem: Problem, rng: np.random.Generator) -> Problem:
    """The problem with distances, and find costs, that are no whole numbers, so that hardly two orders cost the same;
    find costs of which some are cheaper with a walk before or after."""
    stretched = problem.travel.metres * 1.0371
    costs = problem.find_costs
    if costs is not None:
        costs = replace(costs, metres=costs.metres + rng.uniform(0, 6, costs.metres.shape))
    travel = replace(
        problem.travel, metres=stretched + np.abs(np.subtract.outer(*(2 * [rng.uniform(0, 1, len(stretched))])))
    )
    return replace(problem, travel=travel, find_costs=costs)


@pytest.mark.parametrize("whole", [True, False])
def test_the_plan_is_that_of_the_general_search(whole: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    quick, finds = 0, 0
    for seed in range(150):
        problem = random_problem(deliver_goal(*THREE), THREE, seed=seed, places=6, known_share=0.5)
        problem = problem if whole else unequal(problem, np.random.default_rng(seed))
        made, general = solve(problem), generally(problem, monkeypatch)
        assert made.plan == general.plan, seed
        assert made.alternatives == general.alternatives, seed
        quick += is_quick(problem)
        finds += is_quick(problem) and any(step.action == "find" for step in made.plan.steps)
    assert quick > 30
    assert finds > 20


@pytest.mark.parametrize(
    "goal",
    [
        deliver_goal("Mug", "Mug", "Pen"),
        any_goal(*THREE),
        holding_goal("Mug", "Book"),
        breakfast_goal,
        deliver_goal("Mug", "Book", "Pen", "Egg", "Bowl", "Pot"),
    ],
)
def test_goals_of_another_kind_are_left_to_the_general_search(goal: object) -> None:
    types = ("Mug", "Book", "Pen", "Egg", "Bowl", "Pot")
    assert not any(is_quick(random_problem(goal, types, seed=seed, places=5)) for seed in range(6))


def test_a_plan_that_puts_something_down_on_the_way_is_left_to_the_general_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The mug is far from where it is wanted, and the book waits on the way with a short way of its own: carried
    along and put down beside the book, the mug costs a short way back and two manipulations."""
    plan, travel = grid_place(np.array([(0, 0), (10, 0), (10, 1), (15, 0)]))
    start, _, near, far = travel.locations
    knowledge = knowledge_at_start(plan, travel, {}).seen(plan.containers[0].id, (thing("Book", 0),))
    knowledge = replace(knowledge, items_at={**knowledge.items_at, start: (thing("Mug", 0),)})
    goal = AllOf(parts=(Delivered(item_type=ItemType("Book"), at=near), Delivered(item_type=ItemType("Mug"), at=far)))
    cheap = ActionCosts(search=0.0, manipulation=0.1)
    problem = problem_of(goal, knowledge, cheap, locations=travel.locations, find_costs=None)
    made = solve(problem)
    assert made.plan == generally(problem, monkeypatch).plan
    assert [step.action for step in made.plan.steps].count("pick") == 3
    assert not is_quick(problem)


def test_equal_orders_are_left_to_the_general_search() -> None:
    plan, travel = grid_place(np.array([(0, 0), (1, 0), (0, 1)]))
    start, right, above = travel.locations
    knowledge = knowledge_at_start(plan, travel, {})
    for container, item in zip(plan.containers, (thing("Mug", 0), thing("Book", 0)), strict=True):
        knowledge = knowledge.seen(container.id, (item,))
    goal = AllOf(parts=tuple(Delivered(item_type=ItemType(t), at=start) for t in ("Mug", "Book")))
    equal = problem_of(goal, knowledge, COSTS, locations=(start, right, above), find_costs=None)
    assert not is_quick(equal)


def test_manipulations_that_cost_next_to_nothing_are_left_to_the_general_search() -> None:
    """Beside plans of dozens of metres, they are within the tolerance of ties."""
    problem = next(
        made
        for seed in range(50)
        if is_quick(made := random_problem(deliver_goal(*THREE), THREE, seed=seed, places=6))
        and solve(made).plan.cost > 30
    )
    assert not is_quick(replace(problem, costs=ActionCosts(search=0.0, manipulation=2e-7)))


def test_little_time_is_left_to_the_general_search(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = random_problem(deliver_goal(*THREE), THREE, seed=2, places=6)
    asked: list[Problem] = []

    def noted(problem: Problem, *, polish_nodes: int) -> None:
        asked.append(problem)

    monkeypatch.setattr(solver, "delivery_steps", noted)
    solve(problem, budget_s=0.01)
    assert not asked
    solve(problem, budget_s=1.0)
    assert asked == [problem]
