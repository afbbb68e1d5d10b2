"""`lios record --miss-rate`: misses drawn by the seed, told in the log, verified and replayed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from recorders.record_run import record
from recorders.simulated_run import RequestedTask, record_trial, trial_for
from replayers.batch.verify import verify
from replayers.counterfactual.evidence import evidence_of
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.relevance import Assumptions
from replayers.counterfactual.replay import replay_on
from replayers.doctor.examine import examine
from replayers.mcap_io.reader import messages
from replayers.runs.run import read
from workbench.cli import run as lios
from workbench.errors import Malformed
from workbench.execution.events import RunStatus
from workbench.log_schema.perception_json import perception_from_settings
from workbench.worlds.perception import PERFECT
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses


def recorded(path: Path, **options: object) -> Path:
    chosen = {"find": "mug", "strategy": "opt-greedy", "estimator": "counts", "seed": 3, "force": True, **options}
    record(path, **chosen)  # type: ignore[arg-type]
    return path


def test_the_same_seed_misses_the_same_and_no_rate_changes_nothing(tmp_path: Path) -> None:
    said = [
        [
            (m.topic, m.data)
            for m in messages(recorded(tmp_path / f"{i}.mcap", miss_rate=rate))
            if "timing" not in m.topic
        ]
        for i, rate in enumerate((0.7, 0.7, 0.0))
    ]
    assert said[0] == said[1]
    assert not any(b'"look"' in data for topic, data in said[2] if topic == "/search/observation")
    plain = read(tmp_path / "2.mcap")
    assert perception_from_settings(plain.settings) is PERFECT
    assert "perception" not in plain.settings


@pytest.mark.ci
def test_a_run_with_misses_is_reproduced_and_its_looks_add_up(tmp_path: Path) -> None:
    run = read(recorded(tmp_path / "run.mcap", house="houses:5", miss_rate=0.7), with_truth=True)
    assert verify(run).same
    evidence = evidence_of(run)
    looked = [o.container for o in run.observations if not o.known_at_start]
    assert len(looked) > len(set(looked)), "some container was looked into again"
    last = run.observations[-1]
    assert last.look is not None
    assert last.look.number > 1
    assert {i.id for i in last.items} <= {i.id for i in evidence.contents[last.container]}  # type: ignore[index]
    assert run.truth is not None
    for container, items in evidence.contents.items():
        assert {i.id for i in items} <= {i.id for i in run.truth.contents[container]}
    assert [f for f in examine(run.path).findings if f.level in ("error", "warning")] == []


@pytest.mark.ci
def test_a_replay_with_so_many_misses_holds_the_truth(tmp_path: Path) -> None:
    run = read(recorded(tmp_path / "run.mcap", house="houses:5", miss_rate=0.7), with_truth=True)
    word = replay_on(prepare_log(run, ReplaySettings(with_truth=True, worlds=60)), "model-lios")
    assert any("could miss" in note for note in word.notes)
    settings = ReplaySettings(with_truth=True, worlds=60, assumptions=Assumptions(misses=1))
    made = replay_on(prepare_log(run, settings), "model-lios")
    assert made.bounds is not None
    assert made.true_cost is not None
    assert word.bounds is not None
    assert made.true_cost < word.bounds.lower, "a robot that overlooks nothing finds it earlier"
    assert made.bounds.lower - 1e-6 <= made.true_cost <= made.bounds.upper + 1e-6


@pytest.mark.parametrize("rate", ["1", "-0.1", "nan"])
def test_bad_rates_are_refused(tmp_path: Path, rate: str) -> None:
    assert lios(["record", "--find", "mug", "--miss-rate", rate, "-o", str(tmp_path / "x.mcap")]) == 2
    assert not (tmp_path / "x.mcap").exists()


@pytest.mark.parametrize("stored", [1, {"p_detect": 0.0}, {"p_detect": "x"}, {"p_detect": 0.5, "source": "guess"}])
def test_a_log_whose_perception_is_none_is_refused(stored: object) -> None:
    with pytest.raises(Malformed):
        perception_from_settings({"perception": stored})


def test_a_robot_that_trusts_its_looks_remembers_what_it_put_down(tmp_path: Path) -> None:
    """Here the look into the table misses the spoon that the robot put there; the log is reproduced."""
    trial = trial_for(
        RequestedTask(scenario="deliver-3"),
        load_house(f"{shipped_houses()}:4"),
        strategy="model-lios",
        estimator="counts",
        seed=0,
    )
    ended = record_trial(replace(trial, miss_rate=0.3, trusts_looks=True), tmp_path / "run.mcap")
    assert ended.status is RunStatus.DONE
    run = read(tmp_path / "run.mcap")
    assert perception_from_settings(run.settings) is PERFECT
    table = next(o for o in run.observations if o.container == "DiningTable|2|0")
    put = next(a for a in run.actions if a.action == "place" and a.target == table.container)
    assert put.stamp.ns < table.stamp.ns
    assert put.items[0] not in {i.id for i in table.items}
    assert verify(run).same
