"""Strategies by name, and single-find tasks in closed form, on the toy house worked out by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, item, toy_house, toy_plan, toy_travel

from workbench.beliefs.belief import Belief
from workbench.errors import UnknownName
from workbench.planning.plans import PlanStatus
from workbench.planning.strategies import (
    STRATEGIES,
    VARIANTS,
    OracleNeedsHouse,
    StrategyNotLoaded,
    canonical_name,
    strategy,
    strategy_names,
)
from workbench.planning.strategy import View
from workbench.planning.tasks import find_task
from workbench.plugins import NameOrigin
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.house import START, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

MUG = ItemType("Mug")


def view_of(knowledge: Knowledge, probability: list[float], *, at: str = START, budget_s: float = 10.0) -> View:
    belief = Belief(
        item_types=(MUG,),
        containers=knowledge.unsearched,
        probability=np.array([probability]),
        estimator="by hand",
    )
    task = find_task(MUG, LocationId(at))
    return View(knowledge=knowledge, belief=belief, task=task, costs=SIMULATION_COSTS, budget_s=budget_s)


@pytest.fixture
def nothing_known() -> Knowledge:
    return knowledge_at_start(toy_plan(), toy_travel(), {})


@pytest.mark.parametrize("name", [*strategy_names(with_truth=True), *VARIANTS])
def test_every_strategy_finds_in_one_step(name: str, nothing_known: Knowledge) -> None:
    made = strategy(name, house=toy_house()).decide(view_of(nothing_known, [0.1, 0.5, 0.1, 0.1, 0.4]))
    assert made.plan.status is PlanStatus.SOLVED
    assert made.plan.steps[0].action == "find"
    assert made.search_order[0].container in nothing_known.unsearched


def test_optimistic_cost_is_the_least_way(nothing_known: Knowledge) -> None:
    made = strategy("opt-greedy").decide(view_of(nothing_known, [0.1, 0.5, 0.1, 0.1, 0.4]))
    assert made.plan.cost == 1 + 5 + 1  # the table, a metre away, there and back
    assert made.search_order[0].container == TABLE


def test_pessimistic_adds_200(nothing_known: Knowledge) -> None:
    assert strategy("pes-greedy").decide(view_of(nothing_known, [0.1] * 5)).plan.cost == 207


def test_oracle_walks_to_the_nearest_mug(nothing_known: Knowledge) -> None:
    made = strategy("oracle", house=toy_house()).decide(view_of(nothing_known, [0.2] * 5))
    assert made.plan.cost == 2 + 5 + 2
    assert [stop.container for stop in made.search_order] == [COUNTER]


def test_known_is_fetched_without_a_find(nothing_known: Knowledge) -> None:
    knowledge = nothing_known.seen(DESK, (item("Mug|2"),))
    made = strategy("model-lios").decide(view_of(knowledge, [0.1] * 4, at=BED))
    assert [str(step) for step in made.plan.steps] == ["move -> Desk|2", "pick Mug|2 @ Desk|2", "move -> Bed|2"]
    assert made.plan.cost == 7 + 5 + 2
    assert made.find_costs is None


def test_oracle_may_prefer_an_unsearched_nearer_one(nothing_known: Knowledge) -> None:
    knowledge = nothing_known.seen(DESK, (item("Mug|2"),))
    made = strategy("oracle", house=toy_house()).decide(view_of(knowledge, [0.1] * 4))
    assert made.plan.steps[0].action == "find"
    assert made.plan.cost == 9


def test_another_item_in_hand_is_put_down_first(nothing_known: Knowledge) -> None:
    knowledge = nothing_known.moved(LocationId(FRIDGE)).seen(FRIDGE, (item("Egg|1"),)).picked(item("Egg|1"))
    made = strategy("model-lios").decide(view_of(knowledge, [0.9, 0.1, 0.1, 0.1]))
    assert [step.action for step in made.plan.steps] == ["place", "find"]


def test_in_hand_is_carried(nothing_known: Knowledge) -> None:
    knowledge = nothing_known.moved(LocationId(COUNTER)).seen(COUNTER, (item("Mug|1"),)).picked(item("Mug|1"))
    made = strategy("model-lios").decide(view_of(knowledge, [0.1] * 4))
    assert [str(step) for step in made.plan.steps] == ["move -> start"]


def test_nothing_left_to_search_is_a_proof(nothing_known: Knowledge) -> None:
    knowledge = nothing_known
    for container in (FRIDGE, COUNTER, TABLE, BED, DESK):
        knowledge = knowledge.seen(container, ())
    made = strategy("model-lios").decide(view_of(knowledge, []))
    assert made.plan.status is PlanStatus.NO_PLAN
    assert "no container is left" in made.plan.note


def test_no_budget_is_a_status(nothing_known: Knowledge) -> None:
    made = strategy("model-lios").decide(view_of(nothing_known, [0.1] * 5, budget_s=0.0))
    assert made.plan.status is PlanStatus.TIMED_OUT


def test_names() -> None:
    assert canonical_name("ModelLIOS") == "model-lios"
    assert canonical_name("lios") == "model-lios"
    assert canonical_name("greedy") == "opt-greedy"
    assert strategy("PesGreedy").name == "pes-greedy"
    assert "oracle" not in strategy_names(with_truth=False)
    assert list(strategy_names(with_truth=True))[: len(STRATEGIES)] == list(STRATEGIES)


def test_unknown_name_lists_the_near_ones() -> None:
    with pytest.raises(UnknownName, match="model-lios"):
        strategy("modell-lios")


def test_oracle_needs_a_house() -> None:
    with pytest.raises(OracleNeedsHouse):
        strategy("oracle")


def test_a_module_and_class_serve_as_a_name() -> None:
    assert strategy(f"{__name__}:Own", origin=NameOrigin.USER).name == "own"


class Own:
    name = "own"

    def relevant_types(self, task: object) -> tuple[ItemType, ...]:
        return ()

    def decide(self, view: View) -> object:
        raise NotImplementedError


def test_scout_looks_where_it_stands_when_that_tells_much() -> None:
    """Mug and book are missing; the first find goes far, and the table beside the robot may hold both."""
    from workbench.planning.tasks import AllOf, Delivered, Task

    knowledge = knowledge_at_start(toy_plan(), toy_travel(), {}).moved(LocationId(TABLE))
    types = (ItemType("Book"), MUG)
    parts = tuple(Delivered(item_type=t, at=LocationId(BED)) for t in types)
    task = Task(scenario="own", goal=AllOf(parts=parts), failure_cost=400.0, budget_s=60.0)
    belief = Belief(
        item_types=types,
        containers=knowledge.unsearched,
        probability=np.array([[0.0, 0.0, 0.45, 0.0, 0.5], [0.5, 0.0, 0.45, 0.0, 0.0]]),
        estimator="by hand",
    )
    view = View(knowledge=knowledge, belief=belief, task=task, costs=SIMULATION_COSTS, budget_s=60.0)
    made = strategy("scout-lios").decide(view)
    assert made.plan.status is PlanStatus.SOLVED
    assert made.search_order[0].container == TABLE


@pytest.mark.parametrize("name", ["toy:Missing", "no_such_module:Planner"])
def test_what_cannot_be_imported_is_named_with_why(name: str) -> None:
    with pytest.raises(StrategyNotLoaded, match=r"cannot be loaded: .*(Missing|no_such_module)"):
        strategy(name, origin=NameOrigin.USER)


def test_a_search_policy_is_told_what_it_needs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "class Mine:\n    name = 'mine'\n\n    def order(self, query):\n        return ()\n"
    (tmp_path / "own_policy_alone.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(StrategyNotLoaded, match=r"Mine, a search policy, .* returns Composed\(.*policy=Mine\(\)\)"):
        strategy("own_policy_alone:Mine", origin=NameOrigin.USER)
