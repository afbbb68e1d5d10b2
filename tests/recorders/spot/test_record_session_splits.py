"""Long sessions in several files, and the last seconds kept in memory until they are requested."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from spot_help import messages, robot
from test_operator_keys import terminal

from recorders.sinks.files import SplitLimits
from recorders.spot.client.time_source import RunningClock
from recorders.spot.record_session import SessionPlan, record_session
from recorders.spot.session.session import Rates
from replayers.doctor.examine import examine
from replayers.runs.run import read
from workbench.cli import run
from workbench.errors import OutputExists
from workbench.worlds.sites.site import load_site

QUICK = Rates(state_hz=20.0, localization_hz=5.0, fiducials_hz=5.0, images_hz=5.0, grid_hz=1.0, image_ratio=0.25)


def test_a_session_goes_on_in_further_files_and_nothing_is_lost_between_them(tmp_path: Path) -> None:
    plan = SessionPlan(site=load_site("paper_home"), rates=QUICK, for_s=3.2, split=SplitLimits(part_s=1.0))
    with robot(clock=RunningClock()) as (_spot, connection):
        report = record_session(connection, plan, tmp_path / "s.mcap")
    assert [path.name for path in report.files] == [f"s_{i:04d}.mcap" for i in range(len(report.files))]
    assert len(report.files) >= 3
    assert sum(len(messages(path, "/spot/robot_state")) for path in report.files) == report.taken["state"]
    for path in report.files:
        assert read(path).place.plan.containers
    merged = tmp_path / "whole.mcap"
    assert run(["log", "merge", *map(str, report.files), "-o", str(merged)]) == 0
    assert len(messages(merged, "/spot/robot_state")) == report.taken["state"]
    assert read(merged).complete


@pytest.mark.ci
def test_the_last_seconds_are_kept_and_written_at_the_end(tmp_path: Path) -> None:
    plan = SessionPlan(site=load_site("paper_home"), rates=QUICK, for_s=4.0, keep_last_s=1.5)
    with robot(clock=RunningClock()) as (_spot, connection):
        report = record_session(connection, plan, tmp_path / "s.mcap")
        with pytest.raises(OutputExists):
            record_session(connection, plan, tmp_path / "s.mcap")
    assert report.files == (tmp_path / "s.mcap",)
    stamps = [log_time for _, log_time, _, _ in messages(tmp_path / "s.mcap", "/spot/robot_state")]
    assert 0.5 < (max(stamps) - min(stamps)) / 1e9 < 3.0
    assert len(stamps) < report.taken["state"]
    assert read(tmp_path / "s.mcap").complete
    assert not [f for f in examine(tmp_path / "s.mcap").findings if f.level == "error"]


@pytest.mark.ci
def test_a_moment_is_saved_by_key_after_it_happened(tmp_path: Path) -> None:
    log = tmp_path / "s.mcap"
    arguments = ["spot", "record", "-o", str(log), "--images-hz", "0", "--keep-last", "2"]
    with terminal(*arguments, folder=tmp_path) as (window, _spot):
        window.wait_for("Recording")
        time.sleep(2.0)
        assert not list(tmp_path.glob("*.mcap")), "nothing is on the disk before it is asked for"
        window.type("w")
        window.wait_for("s_0000.mcap")
        time.sleep(0.5)
        window.type("d")
        assert window.result() == 0, window.shown
    assert messages(tmp_path / "s_0000.mcap", "/spot/robot_state")
    assert read(log).outcome is not None


def test_what_does_not_go_together_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    there = ["spot", "record", "--robot", "127.0.0.1:9", "-o", str(tmp_path / "s.mcap")]
    for extra, said in (
        (["--keep-last", "5", "--split-s", "5"], "--keep-last"),
        (["--split-mb", "0"], "more than 0"),
        (["--split-s", "-3"], "more than 0"),
        (["--keep-last", "0"], "--keep-last"),
        (["--images-hz", "-1"], "--images-hz"),
        (["--state-hz", "nan"], "--state-hz"),
        (["--for", "0"], "--for"),
    ):
        assert run([*there, *extra]) == 2, extra
        err = capsys.readouterr().err
        assert said in err
        assert len(err.strip().splitlines()) == 1, err
