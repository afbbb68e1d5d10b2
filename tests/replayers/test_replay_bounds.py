"""Bounds over every world that agrees with a log: by hand, and against trying every filling one by one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, item
from toy_logs import BOOK, MUG, OPEN, PENCIL, Even, InOrder, delivered, fillings, task_of, toy_evidence

from replayers.bounds import Bounds, Budget, Proof, bounds_of
from replayers.evidence import Evidence
from replayers.logged_world import LoggedWorld
from replayers.relevance import Assumptions, imputed_items, relevance_of
from replayers.unfolding import Unfolding, no_time
from workbench.execution.events import RunStatus
from workbench.execution.loop import outcome_of, run_task
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.strategies import STRATEGIES, strategy, strategy_names
from workbench.planning.strategy import Decision, Strategy, View
from workbench.planning.tasks import AllOf, AnyOf, Holding, Task, find_task
from workbench.worlds.house import START, ContainerId, ItemType

PLENTY = Budget(stretches=100_000, finish=100_000)

TASKS: dict[str, Task] = {
    "find": find_task(MUG, START),
    "find what nobody saw": find_task(PENCIL, START),
    "two deliveries": task_of(AllOf(parts=(delivered("Mug", BED), delivered("Book", COUNTER)))),
    "two of one type": task_of(AllOf(parts=(delivered("Mug", BED), delivered("Mug", TABLE)))),
    "to an open place": task_of(AllOf(parts=(delivered("Book", DESK), delivered("Pencil", BED)))),
    "any of three": task_of(
        AnyOf(parts=tuple(Holding(item_type=t, at=START) for t in (MUG, BOOK, PENCIL))), failure_cost=100.0
    ),
}


def tree_of(
    evidence: Evidence, planner: Strategy, *, merge: bool = True, assumptions: Assumptions | None = None
) -> Unfolding:
    relevance = relevance_of(evidence, planner.relevant_types(evidence.task), assumptions or Assumptions())
    return Unfolding(evidence, planner, Even(), relevance, merge=merge)


def bounded(evidence: Evidence, planner: Strategy, budget: Budget = PLENTY, **options: object) -> Bounds:
    return bounds_of(tree_of(evidence, planner, **options), budget=budget)  # type: ignore[arg-type]


def cost_in(evidence: Evidence, planner: Strategy, world: dict[ContainerId, tuple[ItemType, ...]]) -> float:
    """The cost in one filling, by the closed loop from start to end."""
    filled = LoggedWorld(evidence, filling=lambda c, _: imputed_items(world[c], c))
    events = run_task(filled, planner, Even(), evidence.task, costs=evidence.costs, stopwatch=no_time)
    return outcome_of(list(events)).cost


def test_by_hand_a_find_that_looks_where_nobody_did(tmp_path: Path) -> None:
    """Bed first (6 m). A mug there: 6 + 5 + 6 = 17. Else the desk (2 m): a mug there: 8 + 5 + 7 = 20.
    Else the table (6 m) in vain and the counter (3 m), where the log saw one: 17 + 5 + 2 = 24."""
    tree = tree_of(toy_evidence(tmp_path), InOrder((BED, DESK, TABLE, COUNTER)))
    bounds = bounds_of(tree, budget=PLENTY)
    assert (bounds.lower, bounds.upper) == (17.0, 24.0)
    assert bounds.lower_proof is bounds.upper_proof is Proof.EXACT
    assert bounds.complete
    assert not bounds.can_fail
    leaves = tree.leaves(most=10)
    assert leaves is not None
    assert sorted(leaf.cost for leaf in leaves) == [17.0, 20.0, 24.0]
    assert tree.leaves(most=2) is None


def test_by_hand_a_run_that_stays_within_the_log_is_exact(tmp_path: Path) -> None:
    bounds = bounded(toy_evidence(tmp_path), InOrder((TABLE, COUNTER)))
    assert bounds.exact
    assert bounds.lower == 11.0
    assert bounds.width == 0.0


def test_what_nobody_saw_may_be_nowhere_and_then_the_failure_is_charged(tmp_path: Path) -> None:
    """A pencil in the desk: 7 + 5 + 7 = 19; nowhere: the failure cost."""
    bounds = bounded(toy_evidence(tmp_path, find_task(PENCIL, START)), InOrder((DESK, BED, TABLE, COUNTER)))
    assert bounds.can_fail
    assert (bounds.lower, bounds.upper) == (19.0, 400.0)


def test_a_type_that_is_known_to_exist_is_somewhere(tmp_path: Path) -> None:
    """The task says that pencils exist; nobody saw one, so the bed or the desk holds one: at worst
    7 to the desk, 2 to the bed, pick 5, back 6."""
    task = replace(find_task(PENCIL, START), available=(MUG, PENCIL))
    planner = InOrder((DESK, BED, TABLE, COUNTER))
    evidence = toy_evidence(tmp_path, task)
    assert bounded(evidence, planner).upper == 20.0
    assert not bounded(evidence, planner).can_fail
    assert bounded(evidence, planner, assumptions=Assumptions(inventory=False)).upper == 400.0
    unavailable = replace(task, available=(MUG,))
    assert bounded(toy_evidence(tmp_path, unavailable), planner).lower == 400.0


def test_where_something_may_be_out_of_reach_existing_promises_nothing(tmp_path: Path) -> None:
    task = replace(find_task(PENCIL, START), available=(PENCIL,))
    evidence = replace(toy_evidence(tmp_path, task), shut=MappingProxyType({BED: "stuck door"}))
    assert bounded(evidence, InOrder((DESK, BED, TABLE, COUNTER))).can_fail


def test_unique_instances_leave_nothing_open(tmp_path: Path) -> None:
    """With no mug but the logged one, bed, desk, table and counter are searched in vain but for the last: 24."""
    planner = InOrder((BED, DESK, TABLE, COUNTER))
    bounds = bounded(toy_evidence(tmp_path), planner, assumptions=Assumptions(unique=True))
    assert bounds.exact
    assert bounds.lower == 24.0


@pytest.mark.parametrize("title", TASKS)
@pytest.mark.parametrize("name", strategy_names(with_truth=False))
def test_bounds_are_the_extremes_over_every_filling(tmp_path: Path, name: str, title: str) -> None:
    evidence = toy_evidence(tmp_path, TASKS[title])
    planner = strategy(name)
    types = relevance_of(evidence, planner.relevant_types(evidence.task), Assumptions()).types
    costs = [cost_in(evidence, planner, world) for world in fillings(types, OPEN)]
    if title == "two of one type":
        two = (MUG, MUG)
        costs += [cost_in(evidence, planner, {BED: a, DESK: b}) for a in ((), two) for b in (two, (MUG,))]
    bounds = bounded(evidence, planner)
    assert bounds.lower == pytest.approx(min(costs))
    assert bounds.upper == pytest.approx(max(costs))
    assert bounds.complete


@pytest.mark.parametrize("title", TASKS)
@pytest.mark.parametrize("name", strategy_names(with_truth=False))
def test_whatever_the_budget_bounds_hold_and_say_what_they_rest_on(tmp_path: Path, name: str, title: str) -> None:
    evidence = toy_evidence(tmp_path, TASKS[title])
    exact = bounded(evidence, strategy(name))
    for stretches in (0, 1, 2, 4, 7):
        bounds = bounded(evidence, strategy(name), Budget(stretches=stretches, finish=0))
        assert bounds.lower <= exact.lower + 1e-9
        assert bounds.upper >= exact.upper - 1e-9
        assert exact.lower - 1e-9 <= bounds.least_found
        assert bounds.largest_found <= exact.upper + 1e-9
        if bounds.lower_proof is Proof.EXACT:
            assert bounds.lower == pytest.approx(exact.lower)
        if bounds.upper_proof is Proof.EXACT:
            assert bounds.upper == pytest.approx(exact.upper)


@pytest.mark.parametrize("title", TASKS)
@pytest.mark.parametrize("name", [n for n in STRATEGIES if n != "oracle"])
def test_sharing_nodes_changes_no_bound(tmp_path: Path, name: str, title: str) -> None:
    evidence = toy_evidence(tmp_path, TASKS[title])
    apart, merged = (bounded(evidence, strategy(name), merge=merge) for merge in (False, True))
    assert (apart.lower, apart.upper) == pytest.approx((merged.lower, merged.upper))
    assert merged.stretches <= apart.stretches


def test_a_run_told_again_from_a_leaf_costs_what_the_leaf_says(tmp_path: Path) -> None:
    tree = tree_of(toy_evidence(tmp_path, TASKS["two deliveries"]), strategy("opt-greedy"))
    bounds_of(tree, budget=PLENTY)
    leaves = tree.leaves(most=100)
    assert leaves
    for leaf in leaves:
        ended = outcome_of(list(tree.events(leaf)))
        assert ended.cost == pytest.approx(leaf.cost)
        assert ended.status is leaf.status


def test_a_strategy_that_does_not_go_straight_loses_the_closer_outer_bound(tmp_path: Path) -> None:
    evidence = toy_evidence(tmp_path)
    tree = tree_of(evidence, InOrder((BED, DESK, TABLE, COUNTER)), merge=False)
    straight = bounds_of(tree, budget=Budget(stretches=0, finish=0))
    tree = tree_of(evidence, InOrder((BED, DESK, TABLE, COUNTER)), merge=False)
    tree.largest_picks = 3
    fumbled = bounds_of(tree, budget=Budget(stretches=0, finish=0))
    assert straight.upper_proof is Proof.STRAIGHT
    assert fumbled.upper_proof is Proof.OUTER
    assert fumbled.upper > straight.upper >= 24.0


def test_a_strategy_that_never_ends_is_stopped_and_charged_the_failure(tmp_path: Path) -> None:
    class Paces(InOrder):
        def decide(self, view: View) -> Decision:
            here = view.knowledge.robot_at
            step = PlanStep(action="move", origin=here, target=FRIDGE if here != FRIDGE else START)
            return Decision(plan=Plan(status=PlanStatus.SOLVED, steps=(step,)))

    bounds = bounded(toy_evidence(tmp_path), Paces(()), merge=False)
    assert bounds.lower == bounds.upper == 400.0
    assert bounds.can_fail


def test_the_cheapest_leaf_is_a_world_that_one_can_name(tmp_path: Path) -> None:
    tree = tree_of(toy_evidence(tmp_path), InOrder((BED, DESK, TABLE, COUNTER)))
    bounds_of(tree, budget=PLENTY)
    leaf = tree.follow(lambda question: question.options[-1])
    assert leaf.status is RunStatus.DONE
    assert [(f.container, f.answer) for f in leaf.filled] == [(BED, (MUG,))]
    assert imputed_items((MUG, MUG), BED)[1].id == f"Mug|imputed|{BED}|2"
    assert item("Mug|1") not in imputed_items((MUG,), BED)
