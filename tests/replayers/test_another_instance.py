"""Where a robot took something and still needs it, a second instance may change its run: no bound forgets that."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from problems import grid_place, thing
from toy_logs import Even, delivered, task_of, toy_evidence, toy_run

from replayers.counterfactual.bounds.bounds import DEFAULT_BUDGET, Bounds
from replayers.counterfactual.bounds.search_cache import SearchCache
from replayers.counterfactual.bounds.world_search import search_worlds
from replayers.counterfactual.decisions.another_instance import room_for_more, with_more
from replayers.counterfactual.decisions.memoized_strategy import MemoizedStrategy, StateKey
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.logged_world import LoggedWorld
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.relevance import Assumptions, relevance_of
from replayers.counterfactual.replay import run_tree_of
from replayers.counterfactual.results import Proof
from replayers.counterfactual.tree.options import zero_clock
from replayers.counterfactual.tree.put_downs import destinations, is_put_down
from workbench.beliefs.belief import Belief, Estimator
from workbench.execution.loop import LoopOptions, outcome_of, run_task
from workbench.planning.actions import relevant_types
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.strategies import strategy
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import AllOf, Delivered, Goal, Holding, Task
from workbench.search.costs import ActionCosts
from workbench.worlds.house import START, ContainerId, Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.travel import TravelCosts

METRES = [
    [0, 14.48, 13.4, 8.64, 15.78, 3.72, 1.25, 9.97],
    [14.48, 0, 10.0, 15.78, 7.04, 13.09, 14.57, 11.34],
    [13.4, 10.0, 0, 19.57, 4.56, 14.69, 12.64, 17.14],
    [8.64, 15.78, 19.57, 0, 20.24, 5.32, 9.88, 5.08],
    [15.78, 7.04, 4.56, 20.24, 0, 16.07, 15.31, 16.79],
    [3.72, 13.09, 14.69, 5.32, 16.07, 0, 4.87, 6.34],
    [1.25, 14.57, 12.64, 9.88, 15.31, 4.87, 0, 11.0],
    [9.97, 11.34, 17.14, 5.08, 16.79, 6.34, 11.0, 0],
]
PLACES = {"Mug": "Shelf|6", "Pencil": "Shelf|5", "Book": "Shelf|0"}
GOAL = AllOf(parts=tuple(delivered(ItemType(kind), at) for kind, at in PLACES.items()))
PEELED = AllOf(
    parts=tuple(
        Delivered(item_type=ItemType(kind), at=LocationId(at), properties=("peeled",))
        for kind, at in (("Apple", "Shelf|1"), ("Tomato", "Shelf|2"))
    )
)
BELIEVED = {"Shelf|1": (0.388, 0.006, 0.516), "Shelf|5": (0.552, 0.065, 0.101), "Shelf|6": (0.034, 0.15, 0.013)}
"""In a book, a mug and a pencil."""


class Fixed:
    """Believes the same of each container in every state."""

    name = "fixed@0"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        rows = [[BELIEVED[c][("Book", "Mug", "Pencil").index(t)] for c in knowledge.unsearched] for t in item_types]
        probability = np.array(rows).reshape(len(item_types), len(knowledge.unsearched))
        return Belief(
            item_types=item_types, containers=knowledge.unsearched, probability=probability, estimator=self.name
        )


def laid_out(
    folder: Path,
    metres: Sequence[Sequence[float]],
    goal: Goal,
    *,
    known: str,
    logged: Mapping[str, tuple[Item, ...]],
    handle: float,
) -> Evidence:
    """Evidence of seven shelves; `known` are empty, and no robot opened those that are not mentioned."""
    plan, travel = grid_place(np.arange(16).reshape(8, 2))
    empty = {ContainerId(f"Shelf|{i}"): tuple[Item, ...]() for i in known}
    contents = {**empty, **{ContainerId(c): items for c, items in logged.items()}}
    base = toy_evidence(folder)
    place = replace(
        base.place, plan=plan, travel=TravelCosts(locations=travel.locations, metres=np.array(metres, dtype=float))
    )
    task = replace(task_of(goal), available=tuple(map(ItemType, ("Book", "Mug", "Pencil"))) if goal == GOAL else ())
    costs = ActionCosts(search=0.0, manipulation=handle)
    return replace(base, place=place, task=task, costs=costs, known=empty, contents=contents, first_belief={})


@pytest.fixture
def delivery(tmp_path: Path) -> Evidence:
    """Nobody opened Shelf|5, which holds the book. The robot takes it along, puts it down on Shelf|6, where it finds
    the pencil, and brings that to Shelf|5 first."""
    logged = {"Shelf|1": (), "Shelf|6": (thing("Mug", 0), thing("Pencil", 0))}
    return laid_out(tmp_path, METRES, GOAL, known="0234", logged=logged, handle=0.5)


@pytest.fixture
def kitchen(tmp_path: Path) -> Evidence:
    """Nobody opened Shelf|5, which holds the apple. The robot takes it to where it hopes to find a knife, and knows
    where that is only when it comes by Shelf|5 once more."""
    points = np.array([[3, 18], [9, 17], [0, 16], [2, 1], [4, 11], [17, 2], [13, 10], [16, 13]])
    metres = np.round(np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1)), 2)
    logged = {"Shelf|1": (), "Shelf|2": (), "Shelf|4": (thing("Knife", 0),), "Shelf|6": (thing("Tomato", 0),)}
    return laid_out(tmp_path, metres.tolist(), PEELED, known="03", logged=logged, handle=1.0)


def cost_with(kind: str, count: int, evidence: Evidence, planner: str, estimator: Estimator) -> float:
    inside = tuple(thing(kind, 10 + number) for number in range(count))

    def filling(container: ContainerId, knowledge: Knowledge) -> tuple[Item, ...]:
        return inside

    world = LoggedWorld(evidence, with_paths=False, filling=filling)
    options, seed = LoopOptions(stopwatch=zero_clock), evidence.info.seed
    run = run_task(
        world, strategy(planner), estimator, evidence.task, costs=evidence.costs, seed=seed, options=options
    )
    return outcome_of(list(run)).cost


def bounds_over(evidence: Evidence, planner: str, estimator: Estimator, folder: Path) -> Bounds:
    prepared = prepare_log(toy_run(folder), ReplaySettings(worlds=0), with_paths=False)
    settings = ReplaySettings(worlds=0, assumptions=Assumptions(unique=True))
    over = replace(prepared, evidence=evidence, estimator=estimator, settings=settings, search_cache=SearchCache())
    tree = run_tree_of(over, strategy(planner))
    return search_worlds(tree, None, DEFAULT_BUDGET, over.search_cache).bounds


def test_bounds_hold_with_a_second_book_where_the_first_was_put_down(delivery: Evidence, tmp_path: Path) -> None:
    one, two = (cost_with("Book", count, delivery, "conditioned-lios", Fixed()) for count in (1, 2))
    assert (one, two) == pytest.approx((48.59, 40.82))
    bounds = bounds_over(delivery, "conditioned-lios", Fixed(), tmp_path)
    assert bounds.lower <= two < one <= bounds.upper
    assert (bounds.lower_proof, bounds.upper_proof) == (Proof.OUTER, Proof.NONE)


def test_a_run_that_carries_straight_stays_exact(delivery: Evidence, tmp_path: Path) -> None:
    bounds = bounds_over(delivery, "opt-lios", Fixed(), tmp_path)
    assert (bounds.lower_proof, bounds.upper_proof) == (Proof.EXACT, Proof.EXACT)


@pytest.mark.parametrize(
    ("planner", "costs"), [("opt-greedy", (127.55, 121.16)), ("conditioned-lios", (123.05, 119.16))]
)
def test_bounds_hold_with_a_second_apple_where_the_first_waits_to_be_peeled(
    kitchen: Evidence, tmp_path: Path, planner: str, costs: tuple[float, float]
) -> None:
    one, two = (cost_with("Apple", count, kitchen, planner, Even()) for count in (1, 2))
    assert (one, two) == pytest.approx(costs)
    bounds = bounds_over(kitchen, planner, Even(), tmp_path)
    assert bounds.lower <= two < one <= bounds.upper
    assert (bounds.lower_proof, bounds.upper_proof) == (Proof.OUTER, Proof.NONE)


def test_a_cook_that_would_do_the_same_with_a_second_apple_stays_exact(kitchen: Evidence, tmp_path: Path) -> None:
    """It knows all but where the apple is, so that nothing makes it change its plan once it has that."""
    known = {**kitchen.known, **kitchen.contents}
    informed = replace(kitchen, known=known)
    one, two = (cost_with("Apple", count, informed, "opt-greedy", Even()) for count in (1, 2))
    bounds = bounds_over(informed, "opt-greedy", Even(), tmp_path)
    assert one == two == pytest.approx(bounds.lower)
    assert (bounds.lower_proof, bounds.upper_proof) == (Proof.EXACT, Proof.EXACT)


def test_another_is_thought_of_only_where_one_was_taken_that_still_matters(kitchen: Evidence) -> None:
    relevance = relevance_of(kitchen, relevant_types(PEELED), Assumptions())
    shelf, apples = ContainerId("Shelf|5"), (thing("Apple", 0), thing("Apple", 1))
    start = knowledge_at_start(kitchen.place.plan, kitchen.place.travel, kitchen.known)
    at_shelf = start.moved(LocationId(shelf))

    def thought_of(knowledge: Knowledge) -> list[str]:
        more = next(with_more(knowledge, room_for_more(knowledge, kitchen.open, relevance)), None)
        return [] if more is None else [item.id for item in more.items_at[LocationId(shelf)]]

    assert thought_of(at_shelf.seen(shelf, apples[:1])) == []
    one, two = (at_shelf.seen(shelf, apples[:count]).picked(apples[0]) for count in (1, 2))
    assert thought_of(one) == []
    assert thought_of(one.moved(START)) == ["Apple|another|Shelf|5|1"]
    assert thought_of(two.moved(START)) == []
    assert thought_of(at_shelf.seen(shelf, (thing("Vase", 0),)).picked(thing("Vase", 0)).moved(START)) == []
    logged = ContainerId("Shelf|4")
    knife = start.moved(LocationId(logged)).seen(logged, kitchen.contents[logged]).picked(thing("Knife", 0))
    assert thought_of(knife.moved(START)) == []


class Tidies:
    """Picks up what was delivered first, as a planner may where that costs nothing."""

    name = "tidies"

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return relevant_types(task.goal)

    def decide(self, view: View) -> Decision:
        (at, item), *_ = view.knowledge.where(ItemType("Mug"))
        step = PlanStep(action="pick", origin=at, target=at, item_types=(item.type,), items=(item.id,))
        return Decision(plan=Plan(status=PlanStatus.SOLVED, steps=(step,)))


@pytest.mark.parametrize("handle", [0.0, 0.5])
def test_a_plan_that_handles_what_no_longer_matters_is_not_another_historys(
    delivery: Evidence, handle: float
) -> None:
    relevance = relevance_of(delivery, relevant_types(GOAL), Assumptions())
    asked = MemoizedStrategy(Tidies(), StateKey(relevance, static_beliefs=True), watch=False)
    start = knowledge_at_start(delivery.place.plan, delivery.place.travel, {})
    named = []
    for number in (0, 1):
        knowledge = start.seen(ContainerId("Shelf|6"), (thing("Mug", number),))
        view = View(
            knowledge=knowledge,
            belief=Fixed().believe(knowledge, ()),
            task=delivery.task,
            costs=ActionCosts(search=0.0, manipulation=handle),
            budget_s=1.0,
        )
        named.append(asked.decide(view).plan.steps[0].items)
    assert named == ([("Mug|0",), ("Mug|1",)] if handle == 0.0 else [("Mug|0",), ("Mug|0",)])


def test_what_counts_as_put_down_on_the_way() -> None:
    def placed(kind: str, at: str, action: str = "place") -> PlanStep:
        place = LocationId(at)
        return PlanStep(
            action=action, origin=place, target=place, item_types=(ItemType(kind),), items=(ItemId(f"{kind}|0"),)
        )

    wanted = destinations(GOAL)
    assert is_put_down(placed("Book", "Shelf|6"), wanted)
    assert not is_put_down(placed("Book", "Shelf|0"), wanted)
    assert not is_put_down(placed("Book", "Shelf|6", action="pick"), wanted)
    assert not is_put_down(placed("Vase", "Shelf|6"), wanted)
    cooked = AllOf(parts=(Delivered(item_type=ItemType("Egg"), at=START, properties=("boiled",)),))
    assert not destinations(cooked)
    assert not destinations(Holding(item_type=ItemType("Book"), at=START))
