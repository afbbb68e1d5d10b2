"""Plans over find costs that are not metric: a walk before or after a find where that costs less."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from problems import any_goal, coffee_goal, deliver_goal, holding_goal, random_problem
from test_solvers_agree import agreed_cost
from toy import TABLE, toy_plan, toy_travel

from workbench.beliefs.belief import Belief
from workbench.beliefs.estimators import estimator
from workbench.evaluation.tasks.trials import TrialKey, prepare_trial
from workbench.execution.events import PlanMade
from workbench.execution.loop import run_task
from workbench.planning.builtin.find_routes import find_routes
from workbench.planning.plans import Plan
from workbench.planning.problem import Problem
from workbench.planning.solvers.fast_downward import FastDownward
from workbench.planning.solvers.single_find import plan_single_find
from workbench.planning.strategies import strategy
from workbench.planning.tasks import Holding
from workbench.search.costs import SIMULATION_COSTS
from workbench.search.engine import expected_search
from workbench.search.find_costs import FindCosts
from workbench.search.policy import SearchQuery
from workbench.worlds.house import START, ItemType, LocationId
from workbench.worlds.knowledge import knowledge_at_start
from workbench.worlds.shipped import shipped_houses
from workbench.worlds.simulated import SimulatedWorld

MUG = ItemType("Mug")
CASES = {
    "deliver": (deliver_goal("Mug", "Book", "Pen"), ("Mug", "Book", "Pen")),
    "any": (any_goal("Mug", "Book", "Pen"), ("Mug", "Book", "Pen")),
    "hold one": (holding_goal("Mug", "Book"), ("Mug", "Book", "Pen")),
    "coffee": (coffee_goal, ("Mug", "CoffeeGrinds", "WaterBottle", "Kettle")),
}


def with_uneven_finds(problem: Problem, seed: int) -> Problem:
    """The same with find costs drawn one by one: far from any triangle inequality."""
    costs = problem.find_costs
    if costs is None:
        return problem
    metres = np.random.default_rng(seed).integers(5, 60, costs.metres.shape).astype(np.float64)
    return replace(problem, find_costs=replace(costs, metres=metres))


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("seed", range(4))
def test_built_in_is_as_good_as_blind_search_over_uneven_finds(case: str, seed: int) -> None:
    goal, types = CASES[case]
    problem = random_problem(goal, types, seed=seed, places=4, known_share=0.3)
    agreed_cost(with_uneven_finds(problem, seed), FastDownward(search="blind"))


def test_routes_by_hand() -> None:
    """Places in a row at 0, 3 and 5 m. A find costs 10 from the second to the third, and 50 between any others."""
    d = np.array([[0.0, 3, 5], [3, 0, 2], [5, 2, 0]])
    tables = np.full((1, 3, 3), 50.0)
    tables[0, 1, 2] = 10.0
    routes = find_routes(tables, d)
    assert routes.metres[0].tolist() == [[18, 15, 13], [15, 12, 10], [17, 14, 12]]
    assert (routes.begin == 1).all()
    assert (routes.end == 2).all()


def test_a_metric_table_is_its_own_route() -> None:
    rng = np.random.default_rng(0)
    at = rng.random((6, 2))
    d = np.linalg.norm(at[:, None] - at[None], axis=2)
    tables = (d[:, 2][:, None] + 5 + d[2][None, :])[None]
    routes = find_routes(tables, d)
    assert (routes.metres == tables).all()
    assert (routes.begin[0] == np.arange(6)[:, None]).all()
    assert (routes.end[0] == np.arange(6)[None]).all()


def single_find(metres: list[list[float]]) -> Plan:
    """Bring a mug from the start to the table, 1 m apart; rows and columns of the costs are these two."""
    here = knowledge_at_start(toy_plan(), toy_travel(), {})
    ends = (START, LocationId(TABLE))
    costs = FindCosts(item_types=(MUG,), origins=ends, targets=ends, metres=np.array([metres]), kind="model")
    return plan_single_find(Holding(item_type=MUG, at=LocationId(TABLE)), here, costs, SIMULATION_COSTS)


def test_a_single_find_walks_first_where_that_costs_less() -> None:
    assert [str(s.action) for s in single_find([[30, 20], [30, 19.0]]).steps] == ["find"], "equal: without a walk"
    walked = single_find([[30, 20], [30, 15.0]])
    assert [(s.action, s.origin, s.target) for s in walked.steps] == [
        ("move", START, TABLE),
        ("find", TABLE, TABLE),
    ]
    assert walked.cost == 16
    assert [s.action for s in single_find([[10, 20], [30, 19.0]]).steps] == ["find", "move"]


def decisions(name: str, scenario: str, house: int) -> list[tuple[PlanMade, Belief, Problem]]:
    key = TrialKey(scenario=scenario, trial=0, houses=str(shipped_houses()), house_index=house, seed=5)
    trial = prepare_trial(key)
    world = SimulatedWorld(trial.house, trial.navigation, known=trial.known)
    planner = strategy(name)
    made: list[tuple[PlanMade, Belief, Problem]] = []
    views = []

    class Watching:
        name = planner.name
        relevant_types = staticmethod(planner.relevant_types)

        def decide(self, view):  # type: ignore[no-untyped-def]
            views.append(view)
            return planner.decide(view)

    for event in run_task(world, Watching(), estimator("counts"), trial.task, costs=trial.costs, seed=1):  # type: ignore[arg-type]
        if isinstance(event, PlanMade):
            made.append((event, views[-1].belief, planner.problem(views[-1])))  # type: ignore[attr-defined]
    return made


@pytest.mark.parametrize(
    ("name", "model"), [("model-lios-per-find", "independent"), ("conditioned-lios-per-find", "exists")]
)
def test_the_planned_cost_of_a_find_is_that_of_the_search_that_is_walked(name: str, model: str) -> None:
    priced = 0
    for planned, belief, problem in decisions(name, "deliver-3", 0):
        for step in planned.made.plan.steps:
            if step.action == "find":
                query = SearchQuery(
                    item_type=step.item_types[0],
                    origin=step.origin,
                    target=step.target,
                    belief=belief,
                    travel=problem.travel,
                    costs=problem.costs,
                )
                walked = expected_search(query, belief_model=model).cost  # type: ignore[arg-type]
                assert step.cost == pytest.approx(walked, rel=1e-9)
                priced += len(belief.containers) > 8
    assert priced, "a house with more containers than candidates"
