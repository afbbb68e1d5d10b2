"""Runs recorded by any strategy pass the doctor without findings."""

from __future__ import annotations

from pathlib import Path

import pytest

from recorders.simulated_run import RequestedTask, record_trial, trial_for
from replayers.doctor.examine import examine
from workbench.planning.strategies import strategy_names
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses


@pytest.mark.ci_but(4)
@pytest.mark.parametrize("scenario", ["deliver-3", "any-of-three"])
@pytest.mark.parametrize("name", strategy_names(with_truth=True))
def test_every_strategy_records_a_sound_log(name: str, scenario: str, tmp_path: Path) -> None:
    house = load_house(f"{shipped_houses()}:5")
    record_trial(
        trial_for(RequestedTask(scenario=scenario), house, strategy=name, estimator="counts"), tmp_path / "run.mcap"
    )
    found = examine(tmp_path / "run.mcap")
    assert [f for f in found.findings if f.level in ("error", "warning")] == []
