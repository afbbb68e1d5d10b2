"""The compiled bounds of plain deliveries are those of the bounds' own classes."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, item
from toy_logs import delivered, task_of, toy_evidence

from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.bounds.branch_and_bound import bounds_of
from replayers.counterfactual.bounds.plain_bounds import plain_bounds_of
from replayers.counterfactual.bounds.plain_kernel import summed
from replayers.counterfactual.bounds.state_bounds import StateBounds
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.relevance import Assumptions, Relevance, relevance_of
from replayers.counterfactual.replay import ReplaySettings, prepare_log, run_tree_of
from replayers.counterfactual.strategy_traits import SearchTraits
from replayers.runs.run import read
from workbench.planning.strategies import strategy
from workbench.planning.tasks import AllOf, AnyOf, Goal, Holding
from workbench.worlds.house import ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

DELIVERIES = Path(__file__).parents[2] / "logs" / "deliver-3.mcap"
MUG, BOOK, LAPTOP = (delivered(ItemType(name), at) for name, at in (("Mug", BED), ("Book", COUNTER), ("Laptop", BED)))
PLAIN = (MUG, AllOf(parts=(MUG,)), AllOf(parts=(MUG, BOOK)), AllOf(parts=(BOOK, LAPTOP, MUG)))
OTHERS = (AnyOf(parts=(MUG, BOOK)), AllOf(parts=(MUG, MUG)), Holding(item_type=ItemType("Mug"), at=LocationId(BED)))
ALL_TRAITS = [
    SearchTraits(nearest_first=nearest, empty_handed=empty, plans_shortest=short)
    for nearest, empty, short in product((False, True), repeat=3)
]


def states(evidence: Evidence, rng: np.random.Generator) -> Iterator[Knowledge]:
    """Random states: some containers searched, some items found, in the hand, or delivered."""
    for _ in range(60):
        known = knowledge_at_start(evidence.place.plan, evidence.travel, evidence.known)
        for container in rng.permutation([TABLE, DESK, FRIDGE, COUNTER, BED])[: rng.integers(6)]:
            if container in known.first_seen:
                continue
            found = tuple(item(f"{t}|{container}") for t in ("Mug", "Book", "Laptop", "Plate") if rng.random() < 0.3)
            known = known.moved(LocationId(container)).seen(container, found)
            if found and rng.random() < 0.5:
                known = known.picked(found[0])
                if rng.random() < 0.6:
                    known = known.moved(LocationId(rng.choice([BED, COUNTER]))).placed()
            if known.holding is not None:
                break
        yield known


def assert_same(evidence: Evidence, relevance: Relevance, traits: SearchTraits, known: Knowledge) -> None:
    plain = plain_bounds_of(evidence, relevance, traits)
    made = None if plain is None else plain.of(known)
    assert made is not None
    bounds = StateBounds(evidence, relevance, traits)
    low, high, certain = bounds.of_classes(known)
    assert made.low == low
    assert made.high == high
    assert (made.certain, made.all_known) == (certain, bounds.most.nothing_missing(known))
    interval = bounds.interval(known)
    assert (interval.low, interval.high, interval.may_fail) == (made.low, made.high, not certain)
    assert bounds.nothing_missing(known) == made.all_known


@pytest.mark.parametrize("goal", PLAIN)
@pytest.mark.parametrize("inventory", [False, True])
def test_of_random_states(tmp_path: Path, goal: Goal, inventory: bool) -> None:
    evidence = toy_evidence(tmp_path, task_of(goal))
    relevance = relevance_of(evidence, (), Assumptions(inventory=inventory))
    rng = np.random.default_rng(5)
    for known in states(evidence, rng):
        assert_same(evidence, relevance, ALL_TRAITS[rng.integers(len(ALL_TRAITS))], known)


@pytest.mark.parametrize("name", ["opt-greedy", "opt-lios", "conditioned-lios"])
def test_of_states_on_the_way(name: str) -> None:
    """Over a log with 24 open containers, of all states that a search of 60 segments comes to."""
    prepared = prepare_log(read(DELIVERIES), ReplaySettings(worlds=0), with_paths=False)
    tree = run_tree_of(prepared, strategy(name))
    bounds = StateBounds(prepared.evidence, tree.relevance, tree.traits)
    bounds_of(tree, budget=Budget(segments=60, finish=0), whatever_is_believed=False)
    waiting, some = [tree.root], 0
    while waiting:
        node = waiting.pop()
        waiting += node.children.values()
        low, high, certain = bounds.of_classes(node.knowledge)
        made = bounds.interval(node.knowledge)
        assert (made.low, made.high, made.may_fail) == (low, high, not certain)
        some += 1
    assert some > 60


@pytest.mark.parametrize("goal", OTHERS)
def test_other_goals_have_none(tmp_path: Path, goal: Goal) -> None:
    evidence = toy_evidence(tmp_path, task_of(goal))
    assert plain_bounds_of(evidence, relevance_of(evidence, (), Assumptions()), SearchTraits()) is None


def test_sums_are_those_of_numpy() -> None:
    rng = np.random.default_rng(3)
    for n in range(129):
        values = rng.random(n) * 100
        assert summed(values) == pytest.approx(values.sum(), rel=1e-15)
