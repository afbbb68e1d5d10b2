"""Decisions that are carried out without asking the strategy are the strategy's own, in any state."""

from __future__ import annotations

import random
from dataclasses import replace
from pathlib import Path

import pytest
from toy_logs import delivered, done_by

from replayers import read
from replayers.counterfactual.decisions.decided import Asked, Unasked
from replayers.counterfactual.evidence import Evidence
from replayers.counterfactual.fast_strategy import fast_strategy
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.tree.delivery_runs import delivery_runs
from replayers.counterfactual.tree.quick_segment import QuickRun
from workbench.beliefs.estimators import estimator
from workbench.planning.composed import Composed
from workbench.planning.strategies import strategy
from workbench.planning.tasks import AllOf, Task
from workbench.worlds.house import Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start

LOGS = Path(__file__).parents[2] / "logs"
TYPES = tuple(map(ItemType, ("Lighter", "Suitcase", "Statue", "Mug", "Egg")))
STATES = 60


@pytest.fixture(scope="module", params=["deliver-3", "spot-home-C"])
def evidence(request: pytest.FixtureRequest) -> Evidence:
    log = read(LOGS / f"{request.param}.mcap")
    return prepare_log(log, ReplaySettings(worlds=0), with_paths=False).evidence


def random_task(evidence: Evidence, chance: random.Random) -> Task:
    """One to five deliveries; now and then one type does not exist."""
    places = [LocationId(c.id) for c in evidence.place.plan.containers]
    types = chance.sample(TYPES, chance.choice((1, 2, 2, 3, 3, 3, 4, 5)))
    goal = AllOf(parts=tuple(delivered(t, chance.choice(places)) for t in types))
    available = tuple(sorted(types)) if chance.random() < 0.9 else tuple(sorted(types[1:]))
    return replace(evidence.task, goal=goal, available=available)


def random_state(evidence: Evidence, chance: random.Random) -> Knowledge:
    """Some containers were looked into, with some items, known ones often near each other."""
    known = knowledge_at_start(evidence.place.plan, evidence.travel, {})
    containers = [c.id for c in evidence.place.plan.containers]
    for container in chance.sample(containers, chance.randrange(len(containers) + 1)):
        types = [t for t in TYPES if chance.random() < 0.15]
        items = [Item(id=ItemId(f"{t}|{chance.randrange(10_000)}"), type=t) for t in types]
        known = known.moved(LocationId(container)).seen(container, tuple(items))
    return known.moved(chance.choice(evidence.travel.locations))


@pytest.mark.parametrize(
    "name", ["opt-greedy", "pes-greedy", "opt-lios", "pes-lios", "model-lios", "conditioned-lios"]
)
def test_segments_are_those_of_the_strategy_in_random_states(evidence: Evidence, name: str) -> None:
    chance, planner, counts = random.Random(name), strategy(name), estimator("counts")
    assert isinstance(planner, Composed)
    unasked = 0
    for _ in range(STATES):
        case = replace(evidence, task=random_task(evidence, chance))
        state, fast = random_state(evidence, chance), fast_strategy(planner)
        quick = QuickRun(case, fast, counts, planner, seed=0).segment(state, steps_left=100)
        asked = QuickRun(case, fast, counts, seed=0).segment(state, steps_left=100)
        assert (quick is None) == (asked is None)
        if quick is None or asked is None:
            continue
        assert (quick.cost, quick.steps, quick.picks) == (asked.cost, asked.steps, asked.picks)
        assert (quick.unobserved, quick.knowledge) == (asked.unobserved, asked.knowledge)
        assert list(map(done_by, quick.decided)) == list(map(done_by, asked.decided))
        assert all(isinstance(one, Asked) for one in asked.decided)
        unasked += sum(isinstance(one, Unasked) for one in quick.decided)
    assert unasked >= STATES / 10


def test_other_strategies_tasks_and_places_are_left_to_the_strategy(evidence: Evidence) -> None:
    def known(case: Evidence, name: str) -> bool:
        planner = strategy(name)
        assert isinstance(planner, Composed)
        return delivery_runs(case, planner, lambda knowledge: pytest.fail("no state was asked for"), None) is not None

    many = AllOf(parts=tuple(delivered(ItemType(f"Type{i}"), LocationId("start")) for i in range(6)))
    assert known(evidence, "model-lios")
    assert not known(evidence, "model-lios-per-find")
    assert not known(evidence, "most-probable")
    assert not known(replace(evidence, task=replace(evidence.task, goal=many)), "model-lios")
    assert not known(replace(evidence, task=replace(evidence.task, budget_s=0.0)), "model-lios")
    cut_off = replace(evidence.travel, unreachable=(evidence.place.plan.containers[0].id,))
    assert not known(replace(evidence, place=replace(evidence.place, travel=cut_off)), "model-lios")
