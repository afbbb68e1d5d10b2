"""Prior costs: of the start of a trial alone, kept with the replays, and none where a strategy breaks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import recorders
from replayers.batch.store import replays_in
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.runs.run import read
from replayers.selection import prior_costs
from replayers.selection.candidates import replay_candidates
from replayers.selection.prior_costs import prior_drawn
from replayers.selection.trial_costs import trial_costs
from workbench.cli import run as lios

NAMES = ("greedy", "conditioned-lios")
SETTINGS = ReplaySettings(worlds=60)
BREAKS = """
class Breaks:
    name = "breaks"

    def relevant_types(self, task):
        return ()

    def decide(self, view):
        raise RuntimeError("no idea")
"""


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """One trial, driven by each of two strategies: they open different containers."""
    folder = tmp_path_factory.mktemp("trial")
    made = [folder / f"{name}.mcap" for name in NAMES]
    for name, log in zip(NAMES, made, strict=True):
        recorders.record(log, find="mug", strategy=name, estimator="counts", seed=4)
    return made


def test_what_a_run_finds_does_not_change_its_priors(logs: list[Path]) -> None:
    one, other = (prior_drawn(prepare_log(read(log), SETTINGS), NAMES) for log in logs)
    assert one == other
    assert {len(costs) for costs in one.values()} == {60}
    assert len(set(one["conditioned-lios"])) > 1


def test_priors_stand_beside_the_costs_and_are_kept(
    logs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = replay_candidates(logs[0], ",".join(NAMES), ("log",), settings=SETTINGS, output=tmp_path)
    costs = trial_costs(made, [r.strategy for r in made], limit=400.0)
    assert costs.prior is not None
    assert costs.prior.mean == pytest.approx([np.mean(r.prior_drawn) for r in made])
    assert costs.prior.variance > 0
    assert {r.prior_drawn for r in replays_in(tmp_path)} == {r.prior_drawn for r in made}
    monkeypatch.setattr(prior_costs, "prepare_log", None)  # nothing is run again
    again = replay_candidates(logs[0], ",".join(NAMES), ("log",), settings=SETTINGS, output=tmp_path)
    assert [r.prior_drawn for r in again] == [r.prior_drawn for r in made]


def test_no_worlds_no_priors(logs: list[Path]) -> None:
    assert prior_drawn(prepare_log(read(logs[0]), ReplaySettings(worlds=0)), NAMES) == {}


def test_a_strategy_that_breaks_has_no_prior(
    logs: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "some_planner.py").write_text(BREAKS)
    found = prior_drawn(prepare_log(read(logs[0]), SETTINGS), ("greedy", "some_planner:Breaks"))
    assert len(found) == 1


def test_the_command_shows_what_is_expected_of_coming_trials(
    logs: list[Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert lios(["select", str(logs[0]), "-s", ",".join(NAMES), "--worlds", "60"]) == 0
    assert "to come" in capsys.readouterr().out
