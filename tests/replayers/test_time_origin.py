"""One old latched message does not stretch the timeline of a log."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from sample_logs import write_toy_log

from recorders.mcap_io.writer import McapWriter
from replayers.log_tools.time_origin import OriginKind, bulk_start
from workbench import cli

S = 10**9


def _latched(path: Path, *, chunk_bytes: int) -> Path:
    with McapWriter(path, chunk_bytes=chunk_bytes) as writer:
        latched, data = writer.add_channel("/map", "raw", 0), writer.add_channel("/data", "raw", 0)
        writer.add_message(latched, b"old", log_time=5)
        for i in range(100):
            writer.add_message(data, b"new", log_time=10**18 + i * S // 10)
    return path


@pytest.mark.parametrize("chunk_bytes", [1, 300, 1 << 20])
def test_seconds_count_from_the_bulk_of_a_foreign_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], chunk_bytes: int
):
    log = _latched(tmp_path / "a.mcap", chunk_bytes=chunk_bytes)
    assert cli.run(["log", "filter", str(log), "-o", str(tmp_path / "b.mcap"), "-S", "2", "-E", "5", "--json"]) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["messages"] == 30
    assert "the bulk of the messages" in told.err
    assert cli.run(["info", str(log), "--json"]) == 0
    about = json.loads(capsys.readouterr().out)
    assert (about["seconds_from"], about["duration_s"]) == (OriginKind.BULK, 9.9)
    assert cli.run(["log", "note", str(log), "here", "--at", "1"]) == 0


def test_seconds_of_a_run_count_from_its_first_event(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    log = write_toy_log(tmp_path / "a.mcap")
    assert cli.run(["info", str(log), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["seconds_from"] == OriginKind.RUN


@pytest.mark.parametrize(
    ("stamps", "origin"),
    [
        ([7], (7, OriginKind.FIRST, 0)),
        ([5, 7], (5, OriginKind.FIRST, 0)),
        ([0, *range(100, 110)], (100, OriginKind.BULK, 1)),
        ([*range(5), *range(100, 105)], (0, OriginKind.FIRST, 0)),
        ([0, 6, *range(100, 150)], (100, OriginKind.BULK, 2)),
        ([*range(0, 500, 5)], (0, OriginKind.FIRST, 0)),
        ([], (0, OriginKind.FIRST, 0)),
    ],
)
def test_the_bulk_begins_after_a_gap_longer_than_all_that_follows(
    stamps: list[int], origin: tuple[int, OriginKind, int]
):
    assert bulk_start(reversed(stamps), count=len(stamps), last_ns=max(stamps, default=0)) == origin
