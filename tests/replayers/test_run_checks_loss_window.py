"""The window of loss in a crash is measured by the recorder's own clock, never by that of a simulated world."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from sample_logs import T0, toy_events, toy_info, toy_options

from recorders.mcap_io.channels import ChannelSpec
from recorders.run_recorder import RunRecorder
from replayers.doctor.examine import examine
from workbench import cli
from workbench.log_schema.events import NANO

STATE = ChannelSpec(topic="/state", message_encoding="x")


def _record(path: Path, **options: object) -> Path:
    """A robot's run whose world lives 45 s in an instant: its state comes in between two events."""
    without_truth = {key: value for key, value in toy_options().items() if key != "truth"}
    changed = without_truth | {"info": toy_info(source="spot")} | options
    with RunRecorder(path, **changed) as recorder:  # type: ignore[arg-type]
        for event in toy_events()[:5]:
            recorder.record(event)
        for i in range(46):
            recorder.sink.write(STATE, b"x", log_time=T0 + i * NANO)
    return path


def test_a_world_faster_than_the_computer_is_told_by_the_recorders_setting(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    found = examine(_record(tmp_path / "a.mcap"))
    assert (found.loss_window_s, found.loss_window_measured) == (1.0, False)
    assert found.longest_chunk_s == 45.0
    cli.run(["doctor", str(tmp_path / "a.mcap")])
    assert "At most 1.000 s would be lost in a crash: the recorder's setting" in capsys.readouterr().out


def test_in_real_time_it_is_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    stamps = iter(range(T0, T0 + 10**6 * NANO, NANO // 100))
    path = _record(tmp_path / "a.mcap", receipt_ns=lambda: next(stamps))
    cli.run(["doctor", str(path), "--json"])
    told = json.loads(capsys.readouterr().out)
    assert told["loss_window_measured"]
    assert told["loss_window_s"] == told["longest_chunk_s"] == 45.0
