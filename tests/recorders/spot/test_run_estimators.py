"""A run on the simulated Spot by an estimator from outside: its log, its replays, and what its mistakes lead to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from spot_help import is_free, robot, run_of

from recorders.spot.run.run import run_and_record, setup_of
from replayers.batch.verify import verify
from replayers.counterfactual.prepared_log import ReplaySettings
from replayers.counterfactual.replay import replay
from replayers.runs.run import read
from workbench.errors import UnknownName
from workbench.plugins import NameOrigin

MINE = """
import numpy as np
from workbench.beliefs.belief import Belief


class Even:
    name = "even@1"
    names_alone = True

    def believe(self, knowledge, item_types):
        shape = (len(item_types), len(knowledge.unsearched))
        return Belief(
            item_types=tuple(item_types),
            containers=tuple(knowledge.unsearched),
            probability=np.full(shape, 0.2),
            estimator=self.name,
        )


class Forgets(Even):
    name = "forgets@1"

    def believe(self, knowledge, item_types):
        if knowledge.first_seen:
            raise RuntimeError("no idea")
        return super().believe(knowledge, item_types)
"""


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with estimators of one's own, worked in."""
    (tmp_path / "spot_beliefs.py").write_text(MINE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.ci
def test_it_drives_the_robot_and_its_log_replays(mine: Path) -> None:
    log = mine / "run.mcap"
    with robot(configuration="A") as (spot, connection):
        report = run_and_record(connection, replace(run_of(spot, sees_m=0.0), estimator="spot_beliefs:Even"), log)
        assert is_free(spot)
    assert report.ended.status == "done"
    run = read(log)
    assert run.info.estimator == "even@1"
    assert {belief.estimator for belief in run.beliefs} == {"even@1"}
    assert {p for belief in run.beliefs for row in belief.probability for p in row} == {0.2}
    assert verify(run).same, "by the log alone"
    own = ReplaySettings(estimator="spot_beliefs:Even", estimator_origin=NameOrigin.USER, worlds=0)
    made = [replay(run, "conditioned-lios", settings) for settings in (own, ReplaySettings(worlds=0))]
    assert [one.exact for one in made] == [True, True]
    assert made[0].cost == made[1].cost


def test_one_that_raises_ends_the_run_with_the_lease_returned_and_a_whole_log(mine: Path) -> None:
    log = mine / "run.mcap"
    with robot(configuration="A") as (spot, connection):
        report = run_and_record(connection, replace(run_of(spot), estimator="spot_beliefs:Forgets"), log)
        assert is_free(spot)
    assert report.ended.status == "estimator-failed"
    assert "no idea" in report.ended.reason
    run = read(log)
    assert run.complete
    assert len([seen for seen in run.observations if not seen.known_at_start]) == 1


def test_one_that_is_not_there_is_refused_before_the_robot_is_called(mine: Path) -> None:
    with robot(configuration="A") as (spot, _):
        run = run_of(spot)
    with pytest.raises(UnknownName):
        setup_of(replace(run, estimator="nope"))
