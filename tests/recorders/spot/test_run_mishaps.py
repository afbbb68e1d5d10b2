"""What doctor, replay and the viewer say of runs in which something went wrong; docs/spot.md shows the table."""

from __future__ import annotations

from pathlib import Path

import pytest
from benchmarks.spot_killed import metres_after_kill
from benchmarks.spot_mishaps import MISHAPS, apply_fault

from replayers.runs.run import read


def test_every_mishap_of_the_table_is_one_of_the_documented_ones() -> None:
    page = (Path(__file__).parents[3] / "docs" / "spot.md").read_text()
    assert [name for name in MISHAPS if f"| {name} |" not in page] == []


@pytest.mark.slow
def test_a_killed_process_leaves_a_log_that_is_cut_off_and_still_replayed(tmp_path: Path) -> None:
    told = apply_fault(MISHAPS["killed"], tmp_path / "killed.mcap")
    assert told.doctor.startswith("3: killed.mcap: lossy")
    assert "lios recover" in told.doctor
    assert "model-lios" in told.replay
    assert "no end" in told.view


@pytest.mark.slow
def test_a_full_disk_ends_the_run_and_the_log_opens(tmp_path: Path) -> None:
    told = apply_fault(MISHAPS["full-disk"], tmp_path / "full.mcap")
    assert "recording stopped" in told.run
    assert "decisions" in told.view
    assert read(tmp_path / "full.mcap").actions


@pytest.mark.slow
def test_an_outage_without_resume_ends_the_run_and_with_it_does_not(tmp_path: Path) -> None:
    stays = apply_fault(MISHAPS["outage-without-resume"], tmp_path / "stays.mcap")
    assert "only with --resume" in stays.run
    assert stays.doctor.startswith("0")
    goes_on = apply_fault(MISHAPS["outages"], tmp_path / "on.mcap")
    assert "Ended: done" in goes_on.run


@pytest.mark.slow
def test_after_its_process_is_killed_the_robot_walks_on_for_half_a_metre_at_most(tmp_path: Path) -> None:
    """Whatever the computer's speed: the last command that was sent has an end time."""
    assert 0 < metres_after_kill(tmp_path) <= 0.5
    assert metres_after_kill(tmp_path, ["--stop-within", "0.4"]) <= 0.4
