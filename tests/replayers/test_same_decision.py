"""Where a decision is the same whatever else open containers hold, the run is followed: both ends are reached with an
estimator that learns from all that is seen, and no other contents lead beyond them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from consistent_worlds import random_world, read_facts, run_in

from recorders.simulated_run import RequestedTask, record_trial, trial_for
from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.decisions import same_decision
from replayers.counterfactual.decisions.same_decision import next_steps
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log
from replayers.counterfactual.replay import in_truth, replay_on
from replayers.counterfactual.strategy_traits import believes_missing_only
from replayers.runs.run import read
from workbench.planning.problem import missing_types
from workbench.planning.strategies import strategy
from workbench.planning.strategy import Decision, Strategy, View
from workbench.planning.tasks import Task
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import ItemType
from workbench.worlds.procthor.load import load_houses
from workbench.worlds.shipped import shipped_houses

HOUSE = 9


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    trial = trial_for(
        RequestedTask(scenario="deliver-3"),
        load_houses(shipped_houses())[HOUSE],
        strategy="pes-greedy",
        estimator="best",
        seed=0,
    )
    record_trial(trial, path)
    return path


@pytest.fixture(scope="module")
def prepared(log: Path) -> PreparedLog:
    return prepare_log(read(log), ReplaySettings(worlds=0))


@pytest.mark.parametrize("name", ["opt-lios", "model-lios"])
def test_ends_are_reached_that_no_other_contents_exceed(log: Path, prepared: PreparedLog, name: str) -> None:
    assert not prepared.static_beliefs
    bounds = replay_on(prepared, name).bounds
    assert bounds is not None
    assert bounds.lower_proof == bounds.upper_proof == "exact"
    assert bounds.lower < bounds.upper
    facts, rng = read_facts(log), np.random.default_rng(3)
    costs = [run_in(facts, random_world(facts, rng, extra=extra), name).cost for extra in (0, 5, 20, 60, 200)]
    assert all(bounds.lower - NEAR_COST <= cost <= bounds.upper + NEAR_COST for cost in costs)


def test_a_strategy_that_may_not_be_asked_again_is_not_followed_as_far(
    log: Path, prepared: PreparedLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = prepare_log(read(log), ReplaySettings(worlds=0, budget=Budget(asked_again=0)))
    few, all_ = replay_on(asked, "model-lios"), replay_on(prepared, "model-lios")
    assert few.bounds is not None
    assert all_.bounds is not None
    assert few.if_beliefs_stand is not None
    assert few.bounds.lower <= all_.bounds.lower
    assert few.bounds.upper > all_.bounds.upper
    monkeypatch.setattr(same_decision, "MAX_ROWS", 1)
    fewer = replay_on(prepare_log(read(log), ReplaySettings(worlds=0)), "opt-lios")
    assert fewer.if_beliefs_stand is not None


class Noting:
    """A strategy that keeps the views by which it decided, with what it decided."""

    def __init__(self, planner: Strategy) -> None:
        self.name = planner.name
        self.made: list[tuple[View, Decision]] = []
        self._planner = planner

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return self._planner.relevant_types(task)

    def decide(self, view: View) -> Decision:
        self.made.append((view, self._planner.decide(view)))
        return self.made[-1][1]


@pytest.mark.parametrize("name", ["opt-lios", "model-lios", "conditioned-lios"])
def test_beliefs_about_what_is_known_change_no_decision_of_those_that_are_asked_again(log: Path, name: str) -> None:
    planner = strategy(name)
    assert believes_missing_only(planner)
    noting, compared = Noting(planner), 0
    in_truth(prepare_log(read(log, with_truth=True), ReplaySettings(worlds=0, with_truth=True)), noting)
    for view, made in noting.made:
        missing = missing_types(view.task.goal, view.knowledge, view.task.available)
        known = [k for k, item_type in enumerate(view.belief.item_types) if item_type not in missing]
        if known and len(view.belief.containers):
            probability = view.belief.probability.copy()
            probability[known] = 0.9
            again = planner.decide(replace(view, belief=replace(view.belief, probability=probability)))
            assert next_steps(again) == next_steps(made)
            compared += 1
    assert compared > 1


def test_a_strategy_that_goes_by_other_beliefs_too_is_not_asked_again(log: Path, prepared: PreparedLog) -> None:
    """scout-lios draws worlds for all that the task needs, also for what it has found."""
    scout = "scout-lios"
    few = prepare_log(read(log), ReplaySettings(worlds=0, budget=Budget(asked_again=0)))
    bounds, without = replay_on(prepared, scout).bounds, replay_on(few, scout).bounds
    assert bounds is not None
    assert without is not None
    assert not believes_missing_only(strategy(scout))
    assert (bounds.lower, bounds.upper) == (without.lower, without.upper)
