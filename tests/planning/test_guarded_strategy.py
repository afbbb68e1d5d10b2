"""Strategies that break: the run ends with a status that says what the strategy did."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from toy import toy_plan, toy_travel

from workbench.beliefs.belief import Belief
from workbench.planning.composed import Composed
from workbench.planning.guarded_strategy import GuardedStrategy
from workbench.planning.plans import PlanStatus
from workbench.planning.strategies import StrategyNotLoaded, strategy
from workbench.planning.strategy import View
from workbench.planning.tasks import find_task
from workbench.plugins import NameOrigin
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.house import START, ItemType
from workbench.worlds.knowledge import knowledge_at_start

PLANNERS = """
from workbench.planning.composed import Composed
from workbench.planning.find_pricing import Optimistic
from workbench.search.policies.registry import policy

class Raises:
    name = "raises"
    def relevant_types(self, task): return ("Mug",)
    def decide(self, view): raise ValueError("out of\\nideas")

class AnswersNothing(Raises):
    def decide(self, view): return None

class KnowsNoTypes(Raises):
    def relevant_types(self, task): raise KeyError("Mug")

class ListsTypes(Raises):
    def relevant_types(self, task): return ["Mug"]

class NoPlanner:
    name = "none"

class CannotBeMade:
    def __init__(self, house): raise RuntimeError("no house, no planner")

def hopeful(house):
    return Composed(name="hopeful", pricing=Optimistic(), policy=policy("lios"))
"""


@pytest.fixture(autouse=True)
def planners_here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "planners_that_break.py").write_text(PLANNERS, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)


def view() -> View:
    mug = ItemType("Mug")
    knowledge = knowledge_at_start(toy_plan(), toy_travel(), {})
    shape = (1, len(knowledge.unsearched))
    belief = Belief(
        item_types=(mug,), containers=knowledge.unsearched, probability=np.full(shape, 0.2), estimator="by hand"
    )
    return View(knowledge=knowledge, belief=belief, task=find_task(mug, START), costs=SIMULATION_COSTS, budget_s=1.0)


@pytest.mark.parametrize(
    ("planner", "types", "why"),
    [
        ("Raises", ("Mug",), "it raised ValueError: out of ideas"),
        ("AnswersNothing", ("Mug",), "it returned nothing instead of a Decision"),
        ("KnowsNoTypes", (), "it raised KeyError: 'Mug'"),
        ("ListsTypes", (), "its relevant_types are of type list, not a tuple of item types"),
    ],
)
def test_what_breaks_is_a_failed_plan_that_says_why(planner: str, types: tuple[str, ...], why: str) -> None:
    made = strategy(f"planners_that_break:{planner}", origin=NameOrigin.USER)
    assert isinstance(made, GuardedStrategy)
    assert made.name == "raises"
    assert made.relevant_types(view().task) == types
    plan = made.decide(view()).plan
    assert (plan.status, plan.note) == (PlanStatus.SOLVER_FAILED, why)


@pytest.mark.parametrize(
    ("planner", "why"),
    [("NoPlanner", "a strategy has name"), ("CannotBeMade", "TypeError: "), ("Missing", "AttributeError: ")],
)
def test_what_is_no_planner_is_refused_with_why(planner: str, why: str) -> None:
    with pytest.raises(StrategyNotLoaded, match=why):
        strategy(f"planners_that_break:{planner}", origin=NameOrigin.USER)


def test_a_composition_of_ones_own_stays_one() -> None:
    """So that its problem can be printed as PDDL, as for the built-in ones."""
    assert isinstance(strategy("planners_that_break:hopeful", origin=NameOrigin.USER), Composed)
