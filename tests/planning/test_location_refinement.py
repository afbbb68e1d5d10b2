"""Planning over few places, then more: never worse than over few, and as good as over all at once."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from problems import breakfast_goal, coffee_goal, random_problem
from toy import BED, toy_house, toy_plan, toy_travel

from replayers.runs.run import read
from workbench import cli
from workbench.beliefs.belief import Belief
from workbench.errors import BadValue
from workbench.planning.builtin.solver import solve
from workbench.planning.composed import Composed
from workbench.planning.plans import PlanStatus
from workbench.planning.problem import Problem
from workbench.planning.solvers.location_refinement import solve_widening
from workbench.planning.strategies import strategy
from workbench.planning.strategy import View
from workbench.planning.tasks import AllOf, Delivered, Task, goal_locations
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.house import Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import knowledge_at_start

CASES = {
    "breakfast": (breakfast_goal, ("Egg", "Bowl", "Pot", "Apple", "Plate", "Knife")),
    "coffee": (coffee_goal, ("Mug", "CoffeeGrinds", "WaterBottle", "Kettle")),
}


def core_of(problem: Problem) -> tuple[LocationId, ...]:
    """Where the robot is, where things are and where they belong."""
    taken = {problem.robot_at, *goal_locations(problem.goal), *(t.at for t in problem.things if t.at is not None)}
    return tuple(p for p in problem.locations if p in taken)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("seed", range(1, 4))
def test_as_good_as_over_all_places_at_once(case: str, seed: int) -> None:
    goal, types = CASES[case]
    problem = random_problem(goal, types, seed=seed, places=4)
    whole = solve(problem, max_nodes=2_000_000, polish_nodes=2_000_000).plan
    few = solve(replace(problem, locations=core_of(problem))).plan
    widened = solve_widening(problem, core_of(problem), budget_s=60).plan
    assert widened.status is whole.status
    if whole.status is PlanStatus.SOLVED:
        assert widened.cost == pytest.approx(whole.cost)
        assert widened.optimal
        assert widened.note == f"optimal over all {len(problem.locations)} places"
        if few.status is PlanStatus.SOLVED:
            assert widened.cost <= few.cost + 1e-9


def test_without_time_no_proof_is_claimed() -> None:
    goal, types = CASES["breakfast"]
    problem = random_problem(goal, types, seed=1, places=4)
    ticks = iter(range(10_000))
    made = solve_widening(problem, core_of(problem), budget_s=3, clock=lambda: float(next(ticks))).plan
    assert not made.optimal or made.lower_bound == pytest.approx(made.cost)
    assert made.status is not PlanStatus.NO_PLAN


def test_a_strategy_says_with_each_plan_what_is_proven() -> None:
    knowledge = knowledge_at_start(toy_plan(), toy_travel(), {})
    types = (ItemType("Book"), ItemType("Mug"))
    parts = tuple(Delivered(item_type=t, at=LocationId(BED)) for t in types)
    task = Task(scenario="own", goal=AllOf(parts=parts), failure_cost=400.0, budget_s=60.0)
    belief = Belief(
        item_types=types,
        containers=knowledge.unsearched,
        probability=[[0.3] * len(knowledge.unsearched)] * 2,  # type: ignore[arg-type]
        estimator="even",
    )
    view = View(knowledge=knowledge, belief=belief, task=task, costs=SIMULATION_COSTS, budget_s=60.0)
    for name in ("model-lios", "scout-lios", "full-lios", "oracle"):
        plan = strategy(f"{name}@everywhere", house=toy_house()).decide(view).plan
        assert plan.optimal
        assert plan.note == f"optimal over all {len(knowledge.travel.locations)} places"
    assert strategy("lios@everywhere").name == "model-lios@everywhere"


@pytest.mark.parametrize("name", ["model-lios", "scout-lios", "oracle"])
def test_a_run_recorded_everywhere_says_what_is_proven(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Breakfast in a shipped house: every plan of the log has its proof, and `lios plan` makes it again."""
    log = tmp_path / "run.mcap"
    words = ["record", "--scenario", "breakfast", "--strategy", f"{name}@everywhere", "-o", str(log), "--json"]
    assert cli.run(words) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["status"], answer["strategy"]) == ("done", f"{name}@everywhere")
    run = read(log)
    assert run.info.strategy == f"{name}@everywhere"
    places = len(run.place.travel.locations)
    proven = re.compile(rf"(optimal|at most \d+\.\d % above the best) over all {places} places")
    assert run.plans
    assert all(proven.match(plan.note) for plan in run.plans)
    if name != "oracle":
        assert cli.run(["plan", str(log), "--json"]) == 0
        again = json.loads(capsys.readouterr().out)
        assert (again["note"], again["places"]) == (run.plans[0].note, places)
        assert again["cost"] == pytest.approx(run.plans[0].expected_cost, abs=1e-4)


def test_a_solver_without_pruning_has_every_place_and_every_known_item() -> None:
    """The cup that no goal asks for is an object too, and so are all containers; the plan is as cheap."""
    knowledge = knowledge_at_start(toy_plan(), toy_travel(), {})
    shelf = knowledge.unsearched[0]
    knowledge = knowledge.seen(shelf, (Item(id=ItemId("cup"), type=ItemType("Cup")),))
    types = (ItemType("Mug"),)
    goal = Delivered(item_type=types[0], at=LocationId(BED))
    task = Task(scenario="own", goal=goal, failure_cost=400.0, budget_s=60.0)
    belief = Belief(
        item_types=types,
        containers=knowledge.unsearched,
        probability=[[0.3] * len(knowledge.unsearched)],  # type: ignore[arg-type]
        estimator="even",
    )
    view = View(knowledge=knowledge, belief=belief, task=task, costs=SIMULATION_COSTS, budget_s=60.0)
    pruned, whole = (strategy(f"model-lios@{at}sas-lmcut") for at in ("", "everywhere-"))
    assert isinstance(pruned, Composed)
    assert isinstance(whole, Composed)
    assert len(pruned.problem(view).locations) < len(knowledge.travel.locations)
    assert set(whole.problem(view).locations) == set(knowledge.travel.locations)
    assert [thing.type for thing in pruned.problem(view).things] == ["Mug"]
    assert [thing.type for thing in whole.problem(view).things] == ["Mug", "Cup"]
    assert whole.decide(view).plan.cost == pytest.approx(pruned.decide(view).plan.cost)
    assert whole.name == "model-lios@everywhere-sas-lmcut"
    with pytest.raises(BadValue, match="without pruning"):
        strategy("oracle@everywhere-sas-lmcut", house=toy_house())
