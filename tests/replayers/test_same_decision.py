"""Where a decision is the same whatever else open containers hold, the run is followed: both ends are reached with an
estimator that learns from all that is seen, and no other contents lead beyond them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from consistent_worlds import random_world, read_facts, run_in

from recorders.simulated_run import RequestedTask, record_trial, trial_for
from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.decisions import same_decision
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log
from replayers.counterfactual.replay import replay_on
from replayers.runs.run import read
from workbench.tolerances import NEAR_COST
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
