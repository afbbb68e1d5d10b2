"""Cached bounds of states equal freshly computed ones, and strategies of one kind share them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, item
from toy_logs import delivered, task_of, toy_evidence

from replayers.counterfactual.bounds.search_cache import SearchCache
from replayers.counterfactual.bounds.state_bounds import StateBounds
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.relevance import Assumptions, relevance_of
from replayers.counterfactual.strategy_traits import SearchTraits
from workbench.planning.tasks import AllOf, AnyOf, Goal, Holding
from workbench.worlds.house import START, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

MUG_TO_BED, BOOK_TO_COUNTER = delivered("Mug", BED), delivered("Book", COUNTER)
TWO = AllOf(parts=(MUG_TO_BED, BOOK_TO_COUNTER))
GOALS = (TWO, AnyOf(parts=(MUG_TO_BED, BOOK_TO_COUNTER)), Holding(item_type=ItemType("Mug"), at=START))


def states(evidence: Evidence) -> Iterator[Knowledge]:
    """Moments that differ in where the robot is, what it holds, what was found where and what is delivered."""
    mug, book = item("Mug|1"), item("Book|1")
    known = knowledge_at_start(evidence.place.plan, evidence.place.travel, evidence.known)
    for at in (START, TABLE, DESK):
        here = known.moved(LocationId(at))
        yield here
        for held in (mug, book):
            found = here.moved(LocationId(TABLE)).seen(TABLE, (held,))
            carried = found.picked(held)
            both = found.seen(FRIDGE, (mug, book))
            yield from (found, carried, both, carried.moved(LocationId(BED)).placed())
            yield both.moved(LocationId(FRIDGE)).picked(mug).moved(LocationId(BED)).placed()


def outside(evidence: Evidence, *, memory: SearchCache | None = None, nearest_first: bool = False) -> StateBounds:
    relevance = relevance_of(evidence, (), Assumptions())
    traits = SearchTraits(nearest_first=nearest_first, empty_handed=True)
    if memory is None:
        return StateBounds(evidence, relevance, traits)
    return memory.outside(evidence, relevance, traits)


@pytest.mark.parametrize("goal", GOALS)
@pytest.mark.parametrize("nearest_first", [False, True])
def test_a_remembered_bound_is_the_bound(tmp_path: Path, goal: Goal, nearest_first: bool) -> None:
    evidence = toy_evidence(tmp_path, task_of(goal))
    shared = outside(evidence, nearest_first=nearest_first)
    first = [shared.interval(state) for state in states(evidence)]
    assert first == [outside(evidence, nearest_first=nearest_first).interval(state) for state in states(evidence)]
    assert first == [shared.interval(state) for state in states(evidence)]
    assert len({(i.low, i.high) for i in first}) > 3, "the states differ"


def test_an_interval_is_its_askers_own(tmp_path: Path) -> None:
    evidence = toy_evidence(tmp_path, task_of(TWO))
    shared, state = outside(evidence), next(states(evidence))
    shared.interval(state).spent = True
    assert not shared.interval(state).spent


def test_strategies_of_one_kind_share_their_bounds(tmp_path: Path) -> None:
    evidence, memory = toy_evidence(tmp_path, task_of(TWO)), SearchCache()
    assert outside(evidence, memory=memory) is outside(evidence, memory=memory)
    assert outside(evidence, memory=memory) is not outside(evidence, memory=memory, nearest_first=True)


def test_what_is_remembered_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    evidence = toy_evidence(tmp_path, task_of(TWO))
    expected = [outside(evidence).interval(state) for state in states(evidence)]
    monkeypatch.setattr("replayers.counterfactual.bounds.state_bounds.MAX_CACHED_STATES", 2)
    monkeypatch.setattr("replayers.counterfactual.bounds.lower_bound.MAX_CACHED_PARTS", 2)
    shared = outside(evidence)
    assert [shared.interval(state) for state in states(evidence)] == expected
