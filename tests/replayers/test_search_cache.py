"""Cached searches equal what the policy would answer again."""

from __future__ import annotations

import gc
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from toy import BED, COUNTER, DESK
from toy_logs import MUG, PENCIL, toy_evidence

from replayers.counterfactual.bounds.branch_and_bound import BoundSearch
from replayers.counterfactual.bounds.search_cache import CachedPolicy, CachedPricing, SearchCache
from replayers.counterfactual.fast_strategy import fast_strategy
from replayers.counterfactual.replay import ReplaySettings, prepare_log, replay_on
from replayers.counterfactual.run_tree import Node, RunTree
from replayers.runs.run import read
from workbench.beliefs.belief import Belief
from workbench.execution.events import PlanMade
from workbench.planning.find_pricing import FindCostRequest, Optimistic
from workbench.planning.strategies import strategy
from workbench.search.find_costs import FindCosts, SearchStop
from workbench.search.policies.registry import POLICIES, policy
from workbench.search.policy import SearchQuery, first_stop
from workbench.worlds.house import START, ContainerId, LocationId


@dataclass(frozen=True)
class Counts:
    """Looks in the belief's order, and counts how often it is asked."""

    asked: list[str] = field(default_factory=list[str], hash=False, compare=False)
    name: str = "counts-calls"

    def order(self, query: SearchQuery) -> tuple[SearchStop, ...]:
        self.asked.append(query.item_type)
        return tuple(
            SearchStop(container=c, probability=0.5, reached=1.0, leg_m=1.0) for c in query.belief.containers
        )


def query(
    folder: Path, p: float, *, origin: str = START, containers: tuple[ContainerId, ...] = (BED, DESK)
) -> SearchQuery:
    evidence = toy_evidence(folder)
    belief = Belief(
        item_types=(MUG, PENCIL),
        containers=containers,
        probability=np.full((2, len(containers)), p),
        estimator="by hand",
    )
    return SearchQuery(
        item_type=MUG, origin=LocationId(origin), target=START, belief=belief, travel=evidence.place.travel,
        costs=evidence.costs,
    )  # fmt: skip


def test_the_same_search_is_worked_out_once(tmp_path: Path) -> None:
    counts = Counts()
    remembered = CachedPolicy(counts, SearchCache())
    asked = [
        query(tmp_path, 0.2),
        query(tmp_path, 0.2),
        query(tmp_path, 0.3),
        query(tmp_path, 0.2, origin=COUNTER),
        query(tmp_path, 0.2, containers=(BED,)),
    ]
    answers = [remembered.order(q) for q in asked]
    assert len(counts.asked) == 4
    assert answers == [counts.order(q) for q in asked]


@pytest.mark.parametrize("name", POLICIES)
def test_a_policy_that_remembers_answers_as_it_does(tmp_path: Path, name: str) -> None:
    ours = policy(name)
    remembered = CachedPolicy(ours, SearchCache())
    for p in (0.2, 0.3, 0.2):
        asked = query(tmp_path, p)
        assert remembered.order(asked) == ours.order(asked)
        assert remembered.first(asked) == first_stop(ours, asked)
    assert remembered.name == ours.name


@dataclass(frozen=True)
class CountsPrices:
    """Optimistic, and counts how often it is asked."""

    asked: list[int] = field(default_factory=list[int], hash=False, compare=False)

    def price(self, request: FindCostRequest) -> FindCosts:
        self.asked.append(1)
        return Optimistic().price(request)

    def meeting_places(self, belief: Belief) -> tuple[LocationId, ...]:
        return ()


def test_the_same_find_costs_are_worked_out_once(tmp_path: Path) -> None:
    counts = CountsPrices()
    remembered = CachedPricing(counts, SearchCache())
    asked = [
        FindCostRequest(belief=q.belief, travel=q.travel, origins=(q.origin,), targets=(q.target,), costs=q.costs)
        for q in (query(tmp_path, 0.2), query(tmp_path, 0.2), query(tmp_path, 0.3), query(tmp_path, 0.2, origin=BED))
    ]
    answers = [remembered.price(request) for request in asked]
    assert len(counts.asked) == 3
    for request, answer in zip(asked, answers, strict=True):
        assert (answer.metres == Optimistic().price(request).metres).all()
        assert answer.origins == request.origins


def test_what_is_remembered_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("replayers.counterfactual.bounds.search_cache.MAX_CACHED_SEARCHES", 3)
    memory = SearchCache()
    for i in range(10):
        CachedPolicy(Counts(), memory).order(query(tmp_path, i / 10))
        assert len(memory.orders) <= 3


def test_strategies_over_one_log_share_a_memory(tmp_path: Path) -> None:
    toy_evidence(tmp_path)
    prepared = prepare_log(read(tmp_path / "toy.mcap"), ReplaySettings(worlds=0))
    replay_on(prepared, "opt-lios")
    known = len(prepared.search_cache.firsts)
    assert known
    replay_on(prepared, "pes-lios")
    assert len(prepared.search_cache.firsts) == known
    assert fast_strategy(strategy("opt-lios"), prepared.search_cache).name == "opt-lios"


def test_a_world_is_told_with_the_whole_order_of_looks(tmp_path: Path) -> None:
    """Branches are decided without words; a run that people read has them."""
    toy_evidence(tmp_path)
    prepared = prepare_log(read(tmp_path / "toy.mcap"), ReplaySettings(worlds=0))
    told = replay_on(prepared, "opt-greedy", worlds=("best",)).worlds["best"]
    assert max(len(event.made.search_order) for event in told if isinstance(event, PlanMade)) > 1


@pytest.mark.ci
@pytest.mark.parametrize("name", ["model-lios", "opt-greedy"])
def test_a_replay_leaves_nothing_for_the_collector(tmp_path: Path, name: str) -> None:
    """Trees of runs are large; they go when the replay is done, those of searches that are shared with the prepared
    log, and none when the collector comes round."""
    toy_evidence(tmp_path)
    prepared = prepare_log(read(tmp_path / "toy.mcap"), ReplaySettings(worlds=5))
    gc.collect()
    gc.freeze()  # what is there already is not looked through below
    gc.disable()
    try:
        replay_on(prepared, name)
        if len(prepared.searched):
            del prepared
        # Not isinstance: it asks every object alive for its __class__, and torch warns at that.
        left = [thing for thing in gc.get_objects() if issubclass(type(thing), Node | RunTree | BoundSearch)]
    finally:
        gc.enable()
    assert not left
