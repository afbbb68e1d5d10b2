"""How long do seven strategies over one Deliver-3 log take? The aim: under 2 s."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from timings import HOLD_FIGURES

from recorders.trial import Wish, record_trial, trial_for
from replayers.batch import Wanted, replay_log, strategies_named
from replayers.replay import Settings
from replayers.stored_replays import StoredReplay
from workbench.worlds.procthor import load_house
from workbench.worlds.shipped import shipped_houses


@pytest.mark.slow
def test_every_strategy_over_one_deliver_3_log(tmp_path: Path, benchmark: Any) -> None:
    trial = trial_for(
        Wish(scenario="deliver-3"), load_house(f"{shipped_houses()}:3"), strategy="model-lios", estimator="counts"
    )
    record_trial(trial, tmp_path / "run.mcap")
    wanted = Wanted(strategies=strategies_named("all", with_truth=False), settings=Settings())
    list(replay_log(tmp_path / "run.mcap", wanted))  # compiled code is loaded once

    def all_of_them() -> list[Any]:
        return list(replay_log(tmp_path / "run.mcap", wanted))

    made = benchmark.pedantic(all_of_them, rounds=3, iterations=1)
    assert len(made) >= 7
    assert all(isinstance(r, StoredReplay) for r in made)
    if HOLD_FIGURES and benchmark.stats is not None:  # None when benchmarks are switched off
        assert benchmark.stats.stats.min < 2
