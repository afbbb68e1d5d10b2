"""Where a robot puts something down on the way, a second instance may change its run: nothing is exact any more."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from problems import grid_place, thing
from toy_logs import delivered, task_of, toy_evidence, toy_run

from replayers.counterfactual.bounds.bounds import DEFAULT_BUDGET
from replayers.counterfactual.bounds.search_cache import SearchCache
from replayers.counterfactual.bounds.world_search import search_worlds
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.logged_world import LoggedWorld
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log
from replayers.counterfactual.relevance import Assumptions
from replayers.counterfactual.replay import run_tree_of
from replayers.counterfactual.results import Proof
from replayers.counterfactual.run_tree import zero_clock
from replayers.counterfactual.tree.put_downs import destinations, is_put_down
from workbench.beliefs.belief import Belief
from workbench.execution.loop import LoopOptions, outcome_of, run_task
from workbench.planning.plans import PlanStep
from workbench.planning.strategies import strategy
from workbench.planning.tasks import AllOf, Delivered, Holding
from workbench.search.costs import ActionCosts
from workbench.worlds.house import START, ContainerId, Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge
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


@pytest.fixture
def evidence(tmp_path: Path) -> Evidence:
    """Nobody opened Shelf|5, which holds the book. The robot takes it along, puts it down on Shelf|6, where it finds
    the pencil, and brings that to Shelf|5 first."""
    plan, travel = grid_place(np.arange(16).reshape(8, 2))
    known = {ContainerId(f"Shelf|{i}"): tuple[Item, ...]() for i in (0, 2, 3, 4)}
    logged = {**known, ContainerId("Shelf|1"): (), ContainerId("Shelf|6"): (thing("Mug", 0), thing("Pencil", 0))}
    base = toy_evidence(tmp_path)
    place = replace(
        base.place, plan=plan, travel=TravelCosts(locations=travel.locations, metres=np.array(METRES, dtype=float))
    )
    task = replace(task_of(GOAL), available=tuple(map(ItemType, ("Book", "Mug", "Pencil"))))
    costs = ActionCosts(search=0.0, manipulation=0.5)
    return replace(base, place=place, task=task, costs=costs, known=known, contents=logged, first_belief={})


def cost_with(books: int, evidence: Evidence) -> float:
    inside = tuple(thing("Book", number) for number in range(books))

    def filling(container: ContainerId, knowledge: Knowledge) -> tuple[Item, ...]:
        return inside

    world = LoggedWorld(evidence, with_ways=False, filling=filling)
    options = LoopOptions(stopwatch=zero_clock)
    planner, seed = strategy("conditioned-lios"), evidence.info.seed
    return outcome_of(
        list(run_task(world, planner, Fixed(), evidence.task, costs=evidence.costs, seed=seed, options=options))
    ).cost


def prepared_with(evidence: Evidence, folder: Path) -> PreparedLog:
    prepared = prepare_log(toy_run(folder), ReplaySettings(worlds=0), with_ways=False)
    settings = ReplaySettings(worlds=0, assumptions=Assumptions(unique=True))
    return replace(prepared, evidence=evidence, estimator=Fixed(), settings=settings, search_cache=SearchCache())


def test_bounds_hold_with_a_second_book_where_the_first_was_put_down(evidence: Evidence, tmp_path: Path) -> None:
    one, two = cost_with(1, evidence), cost_with(2, evidence)
    assert (one, two) == pytest.approx((48.59, 40.82))
    prepared = prepared_with(evidence, tmp_path)
    tree = run_tree_of(prepared, strategy("conditioned-lios"))
    bounds = search_worlds(tree, None, DEFAULT_BUDGET, prepared.search_cache).bounds
    assert bounds.lower <= two < one <= bounds.upper
    assert (bounds.lower_proof, bounds.upper_proof) == (Proof.OUTER, Proof.NONE)


def test_a_run_that_carries_straight_stays_exact(evidence: Evidence, tmp_path: Path) -> None:
    prepared = prepared_with(evidence, tmp_path)
    tree = run_tree_of(prepared, strategy("opt-lios"))
    bounds = search_worlds(tree, None, DEFAULT_BUDGET, prepared.search_cache).bounds
    assert (bounds.lower_proof, bounds.upper_proof) == (Proof.EXACT, Proof.EXACT)


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
