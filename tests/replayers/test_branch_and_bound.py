"""Bounds over every consistent world: by hand, and against enumerating every assignment."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, item
from toy_logs import BOOK, MUG, OPEN, PENCIL, Even, InOrder, delivered, fillings, task_of, toy_evidence

from replayers.counterfactual.bounds.bounds import Bounds, Budget
from replayers.counterfactual.bounds.branch_and_bound import bounds_of
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.fast_strategy import fast_strategy
from replayers.counterfactual.logged_world import LoggedWorld
from replayers.counterfactual.relevance import Assumptions, demand, imputed_items, relevance_of
from replayers.counterfactual.results import Assignment, Proof
from replayers.counterfactual.run_tree import RunTree
from replayers.counterfactual.strategy_traits import search_traits, uses_beliefs
from replayers.counterfactual.tree.options import TreeOptions, zero_clock
from workbench.beliefs.belief import Belief
from workbench.execution.events import RunStatus
from workbench.execution.loop import LoopOptions, outcome_of, run_task
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.strategies import STRATEGIES, strategy, strategy_names
from workbench.planning.strategy import Decision, Strategy, View
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Holding, Task, find_task
from workbench.worlds.house import START, ContainerId, Item, ItemId, ItemType
from workbench.worlds.knowledge import Knowledge

PLENTY = Budget(segments=100_000, finish=100_000)

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
) -> RunTree:
    relevance = relevance_of(evidence, planner.relevant_types(evidence.task), assumptions or Assumptions())
    options = TreeOptions(
        merge=merge,
        traits=search_traits(planner, evidence.task.goal),
    )
    return RunTree(evidence, planner, Even(), relevance, options)


def bounded(evidence: Evidence, planner: Strategy, budget: Budget = PLENTY, **options: object) -> Bounds:
    return bounds_of(tree_of(evidence, planner, **options), budget=budget)  # type: ignore[arg-type]


def cost_in(evidence: Evidence, planner: Strategy, world: dict[ContainerId, tuple[ItemType, ...]]) -> float:
    """The cost in one filling, by the closed loop from start to end."""
    filled = LoggedWorld(evidence, filling=lambda c, _: imputed_items(world[c], c))
    events = run_task(
        filled, planner, Even(), evidence.task, costs=evidence.costs, options=LoopOptions(stopwatch=zero_clock)
    )
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
    assert sorted((told.least, told.most) for told in bounds.groups) == [(17.0, 17.0), (20.0, 20.0), (24.0, 24.0)]


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
    evidence = replace(toy_evidence(tmp_path, task), refused_searches=MappingProxyType({BED: "stuck door"}))
    assert bounded(evidence, InOrder((DESK, BED, TABLE, COUNTER))).can_fail


def test_unique_instances_leave_nothing_open(tmp_path: Path) -> None:
    """With no mug but the logged one, bed, desk, table and counter are searched in vain but for the last: 24."""
    planner = InOrder((BED, DESK, TABLE, COUNTER))
    bounds = bounded(toy_evidence(tmp_path), planner, assumptions=Assumptions(unique=True))
    assert bounds.exact
    assert bounds.lower == 24.0


@pytest.mark.ci_but(8)
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


UNIQUE: dict[str, Task] = {
    **{title: TASKS[title] for title in ("two deliveries", "two of one type", "any of three")},
    "two shown, to one place, and one that nobody saw": task_of(
        AllOf(parts=(delivered("Egg", START), delivered("Apple", START), delivered("Pencil", BED)))
    ),
    "two shown, from the place of a look": task_of(
        AllOf(parts=(delivered("Bowl", START), delivered("Plate", START), delivered("Pencil", COUNTER)))
    ),
    "one shown, two that nobody saw": task_of(
        AllOf(parts=(delivered("Egg", TABLE), delivered("Book", TABLE), delivered("Pencil", BED)))
    ),
}


@pytest.mark.ci_but(6)
@pytest.mark.parametrize("title", UNIQUE)
@pytest.mark.parametrize("name", strategy_names(with_truth=False))
def test_where_unique_things_stand_tells_states_apart(tmp_path: Path, name: str, title: str) -> None:
    """scout-lios decides anew after the egg is put down at the start, and again after the apple: two states, though
    no open container can hold either."""
    evidence, planner, unique = toy_evidence(tmp_path, UNIQUE[title]), strategy(name), Assumptions(unique=True)
    types = relevance_of(evidence, planner.relevant_types(evidence.task), unique).types
    worlds = [w for w in fillings(types, OPEN) if all(sum(t in w[c] for c in OPEN) < 2 for t in types)]
    costs = [cost_in(evidence, planner, world) for world in worlds]
    for merge in (False, True):
        bounds = bounded(evidence, planner, merge=merge, assumptions=unique)
        assert (bounds.lower, bounds.upper) == pytest.approx((min(costs), max(costs)))
        assert bounds.complete


@pytest.mark.ci_but(6)
@pytest.mark.parametrize("title", TASKS)
@pytest.mark.parametrize("name", strategy_names(with_truth=False))
def test_whatever_the_budget_bounds_hold_and_say_what_they_rest_on(tmp_path: Path, name: str, title: str) -> None:
    evidence = toy_evidence(tmp_path, TASKS[title])
    exact = bounded(evidence, strategy(name))
    for segments in (0, 1, 2, 4, 7):
        bounds = bounded(evidence, strategy(name), Budget(segments=segments, finish=0))
        assert bounds.lower <= exact.lower + 1e-9
        assert bounds.upper >= exact.upper - 1e-9
        assert exact.lower - 1e-9 <= bounds.least_found
        assert bounds.largest_found <= exact.upper + 1e-9
        if bounds.lower_proof is Proof.EXACT:
            assert bounds.lower == pytest.approx(exact.lower)
        if bounds.upper_proof is Proof.EXACT:
            assert bounds.upper == pytest.approx(exact.upper)
        assert bool(bounds.why_outer) == (not bounds.lower_proof is bounds.upper_proof is Proof.EXACT)


@pytest.mark.ci_but(6)
@pytest.mark.parametrize("title", TASKS)
@pytest.mark.parametrize("name", [n for n in STRATEGIES if n != "oracle"])
def test_sharing_nodes_changes_no_bound(tmp_path: Path, name: str, title: str) -> None:
    evidence = toy_evidence(tmp_path, TASKS[title])
    apart, merged = (bounded(evidence, strategy(name), merge=merge) for merge in (False, True))
    assert (apart.lower, apart.upper) == pytest.approx((merged.lower, merged.upper))
    assert merged.segments <= apart.segments


@pytest.mark.parametrize("title", TASKS)
def test_the_cheapest_and_the_dearest_world_are_told_again_with_the_cost_of_the_bounds(
    tmp_path: Path, title: str
) -> None:
    tree = tree_of(toy_evidence(tmp_path, TASKS[title]), strategy("opt-greedy"))
    bounds = bounds_of(tree, budget=PLENTY)
    for leaf, cost in ((bounds.cheapest, bounds.lower), (bounds.most_expensive, bounds.upper)):
        assert leaf is not None
        ended = outcome_of(list(tree.events(leaf, explained_by=strategy("opt-greedy"))))
        assert ended.cost == pytest.approx(leaf.cost)
        assert ended.cost == pytest.approx(cost)
        assert ended.status is leaf.status


@pytest.mark.ci_but(6)
@pytest.mark.parametrize("title", TASKS)
@pytest.mark.parametrize("segments", [0, 2, 5, 100_000])
def test_what_is_told_of_groups_of_worlds_holds_in_each_of_them(tmp_path: Path, title: str, segments: int) -> None:
    """Every filling belongs to a group that says what it costs."""
    evidence, planner = toy_evidence(tmp_path, TASKS[title]), strategy("opt-greedy")
    bounds = bounded(evidence, planner, Budget(segments=segments, finish=0))
    assert min(told.least for told in bounds.groups) == pytest.approx(bounds.lower)
    assert max(told.most for told in bounds.groups) == pytest.approx(bounds.upper)
    types = relevance_of(evidence, planner.relevant_types(evidence.task), Assumptions()).types
    for world in fillings(types, OPEN):
        cost = cost_in(evidence, planner, world)
        mine = [t for t in bounds.groups if all(_fits(f, world[f.container]) for f in t.filled)]
        assert mine
        assert all(t.least - 1e-6 <= cost <= t.most + 1e-6 for t in mine)


def _fits(filled: Assignment, inside: tuple[ItemType, ...]) -> bool:
    return filled.answer == tuple(t for t in sorted(inside) if t in filled.live)


@dataclass(frozen=True)
class Whimsical:
    """A belief that everything seen turns round: what else lies in a container decides where to look next."""

    twist: int
    name: str = "whimsical@0"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        seen = sorted(i.id for items in knowledge.first_seen.values() for i in items)
        rng = np.random.default_rng([self.twist, *"".join(seen).encode()])
        shape = (len(item_types), len(knowledge.unsearched))
        return Belief(item_types=item_types, containers=knowledge.unsearched, probability=rng.random(shape),
                      estimator=self.name)  # fmt: skip


@pytest.mark.ci_but(2)
@pytest.mark.parametrize("title", ["find", "two deliveries"])
@pytest.mark.parametrize("name", ["opt-greedy", "model-lios", "scout-lios"])
def test_bounds_hold_whatever_else_open_containers_held_and_did_to_the_beliefs(
    tmp_path: Path, name: str, title: str
) -> None:
    evidence, planner = toy_evidence(tmp_path, TASKS[title]), strategy(name)
    relevance = relevance_of(evidence, planner.relevant_types(evidence.task), Assumptions())
    clutter = [(), (Item(id=ItemId("Vase|1"), type=ItemType("Vase")),), (item("Fork|1"), item("Fork|2"))]
    for twist in (0,):
        believer = Whimsical(twist)
        tree = RunTree(
            evidence, planner, believer, relevance, TreeOptions(
                merge=True, static_beliefs=False, reads_beliefs=uses_beliefs(planner, evidence.task.goal)
            ),
        )  # fmt: skip
        bounds = bounds_of(tree, budget=PLENTY)
        if_standing = bounds_of(tree, budget=PLENTY, whatever_is_believed=False)
        assert if_standing.complete
        for world in fillings(relevance.types, OPEN):
            for more in clutter:
                filled = LoggedWorld(
                    evidence, filling=lambda c, _, w=world, m=more: (*imputed_items(w[c], c), *m) if c == BED
                    else imputed_items(w[c], c),
                )  # fmt: skip
                events = run_task(
                    filled,
                    planner,
                    believer,
                    evidence.task,
                    costs=evidence.costs,
                    options=LoopOptions(stopwatch=zero_clock),
                )
                cost = outcome_of(list(events)).cost
                assert bounds.lower - 1e-9 <= cost <= bounds.upper + 1e-9
                if not more:
                    assert if_standing.lower - 1e-9 <= cost <= if_standing.upper + 1e-9
        if "greedy" in name:
            assert bounds.complete, "distance alone decides"


@pytest.mark.ci_but(3)
@pytest.mark.parametrize("title", TASKS)
@pytest.mark.parametrize("name", ["opt-greedy", "pes-greedy"])
def test_a_strategy_that_is_said_to_ignore_beliefs_does(tmp_path: Path, name: str, title: str) -> None:
    evidence, planner = toy_evidence(tmp_path, TASKS[title]), strategy(name)
    assert not uses_beliefs(planner, evidence.task.goal)
    for world in fillings((MUG, BOOK), OPEN):
        costs = set()
        for believer in (Even(), Whimsical(0), Whimsical(1), Whimsical(2)):
            filled = LoggedWorld(evidence, filling=lambda c, _, w=world: imputed_items(w[c], c))
            events = run_task(
                filled,
                planner,
                believer,
                evidence.task,
                costs=evidence.costs,
                options=LoopOptions(stopwatch=zero_clock),
            )
            costs.add(outcome_of(list(events)).cost)
        assert len(costs) == 1


@pytest.mark.ci_but(6)
@pytest.mark.parametrize("title", TASKS)
@pytest.mark.parametrize("name", strategy_names(with_truth=False))
def test_a_strategy_without_words_does_the_same(tmp_path: Path, name: str, title: str) -> None:
    evidence = toy_evidence(tmp_path, TASKS[title])
    told = [bounded(evidence, planner).groups for planner in (strategy(name), fast_strategy(strategy(name)))]
    assert told[0] == told[1]


def test_strategies_that_read_beliefs_are_not_said_to_ignore_them() -> None:
    goal = TASKS["two deliveries"].goal
    assert [n for n in strategy_names(with_truth=False) if not uses_beliefs(strategy(n), goal)] == [
        "opt-greedy", "pes-greedy",
    ]  # fmt: skip
    boiled = Delivered(item_type=ItemType("Egg"), at=START, properties=("boiled",))
    assert uses_beliefs(strategy("opt-greedy"), boiled)
    assert uses_beliefs(InOrder(()), goal)


def test_where_a_container_can_answer_too_much_the_other_answers_are_bounded_from_outside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    evidence, planner = toy_evidence(tmp_path, TASKS["to an open place"]), strategy("opt-greedy")
    exact = bounded(evidence, planner)
    monkeypatch.setattr("replayers.counterfactual.relevance.MAX_ANSWERS", 2)
    few = bounded(evidence, planner)
    assert not few.complete
    assert few.lower <= exact.lower + 1e-9
    assert few.upper >= exact.upper - 1e-9
    assert few.groups
    assert max(t.most for t in few.groups) == pytest.approx(few.upper)


def test_demand_is_one_instance_for_each_part_that_can_use_it() -> None:
    boiled, plate = ItemType("Egg"), ItemType("Plate")
    breakfast = AllOf(parts=(
        Delivered(item_type=boiled, at=START, properties=("boiled",)),
        AnyOf(parts=(Delivered(item_type=plate, at=START), AllOf(parts=(delivered("Plate", BED),) * 2))),
    ))  # fmt: skip
    assert demand(breakfast) == {"Egg": 1, "Kettle": 1, "Pot": 1, "Plate": 2}


def test_a_strategy_that_does_not_go_straight_loses_the_closer_outer_bound(tmp_path: Path) -> None:
    evidence = toy_evidence(tmp_path)
    tree = tree_of(evidence, InOrder((BED, DESK, TABLE, COUNTER)), merge=False)
    straight = bounds_of(tree, budget=Budget(segments=0, finish=0))
    tree = tree_of(evidence, InOrder((BED, DESK, TABLE, COUNTER)), merge=False)
    tree.max_picks = 3
    fumbled = bounds_of(tree, budget=Budget(segments=0, finish=0))
    assert straight.upper_proof is Proof.STRAIGHT
    assert fumbled.upper_proof is Proof.NONE
    assert fumbled.upper == inf
    assert straight.upper >= 24.0


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
    leaf = tree.follow(lambda unobserved: unobserved.options[-1])
    assert leaf.status is RunStatus.DONE
    assert [(f.container, f.answer) for f in leaf.filled] == [(BED, (MUG,))]
    assert imputed_items((MUG, MUG), BED)[1].id == f"Mug|imputed|{BED}|2"
    assert item("Mug|1") not in imputed_items((MUG,), BED)
