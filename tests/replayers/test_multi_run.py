"""Several runs in one log, and each in a file again, unchanged; by the command line, with the sample logs."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest
from mcap.records import Attachment, Metadata
from sample_logs import killed_toy_log, write_toy_log

import replayers
from replayers.log_tools.copy_log import ReadLoss, contents
from replayers.log_tools.multi_run import SeveralRuns, runs_of
from replayers.mcap_io.messages import Message
from replayers.mcap_io.reader import messages
from replayers.tables.schemas import SCHEMAS
from workbench import cli

LOGS = Path(__file__).resolve().parents[2] / "logs"
SOURCES = [LOGS / f"{name}.mcap" for name in ("find-lios", "find-greedy", "spot-home-A")]


@pytest.fixture
def merged(tmp_path: Path) -> Path:
    assert cli.run(["log", "merge", *map(str, SOURCES), "-o", str(tmp_path / "all.mcap"), "--runs"]) == 0
    return tmp_path / "all.mcap"


def taken_apart(merged: Path, folder: Path) -> list[Path]:
    assert cli.run(["log", "split", str(merged), "-o", str(folder / "run.mcap"), "--by", "run"]) == 0
    return sorted(folder.iterdir())


def everything(path: Path) -> tuple[list, dict]:
    """Messages in their order, with all that is told of their channels; attachments and metadata by name."""
    loss = ReadLoss()
    said, named = [], {}
    for part in contents(path, loss):
        if isinstance(part, Message):
            channel, schema = part.channel, part.schema
            told = (channel.topic, channel.metadata, channel.message_encoding, schema and (schema.name, schema.data))
            said.append((told, *part[2:]))
        elif isinstance(part, Attachment | Metadata):
            named[part.name] = part
    assert not loss.any
    return said, named


def test_runs_that_were_merged_are_taken_apart_again(merged: Path, tmp_path: Path):
    parts = taken_apart(merged, tmp_path / "runs")
    assert [part.name for part in parts] == ["run_0000.mcap", "run_0001.mcap", "run_0002.mcap"]
    for source, part in zip(SOURCES, parts, strict=True):
        assert cli.run(["doctor", str(part)]) == 0
        assert everything(part) == everything(source)
        before, after = replayers.read(source).tables, replayers.read(part).tables
        for name in SCHEMAS:
            ours, theirs = getattr(after, name), getattr(before, name)
            pd.testing.assert_frame_equal(
                ours.drop(columns="path", errors="ignore"), theirs.drop(columns="path", errors="ignore")
            )  # fmt: skip


def test_a_log_of_several_runs_is_told_apart_from_a_run(
    merged: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    assert cli.run(["doctor", str(merged), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["verdict"] == "fine"
    assert any("3 in one log" in finding["what"] for finding in told["findings"])
    assert cli.run(["info", str(merged), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["run"], told["runs"]) == (None, 3)
    assert cli.run(["list", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"][0]["problem"] == "holds 3 runs"
    with pytest.raises(SeveralRuns):
        replayers.read(merged)
    tables = replayers.read_many(merged)
    assert not len(tables.runs)
    assert "several runs" in tables.problems[0].reason
    assert cli.run(["replay", str(merged), "--strategies", "pes-lios"]) == 2
    assert "lios log split" in capsys.readouterr().err
    assert cli.run(["export", str(merged), "-o", str(tmp_path / "tables")]) == 2
    assert "several runs" in capsys.readouterr().err
    assert not (tmp_path / "tables").exists()


def test_doctor_looks_at_each_run_of_a_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    fine, killed = write_toy_log(tmp_path / "a.mcap"), killed_toy_log(tmp_path / "b.mcap")
    assert cli.run(["log", "merge", str(fine), str(killed), "-o", str(tmp_path / "all.mcap"), "--runs"]) in (0, 3)
    capsys.readouterr()
    cli.run(["doctor", str(tmp_path / "all.mcap"), "--json"])
    findings = json.loads(capsys.readouterr().out)["findings"]
    assert any("outcome" in finding["what"] + finding["where"] for finding in findings), "the second run has none"


def test_several_runs_that_were_cut_off_are_saved_each_with_its_identity(merged: Path, tmp_path: Path):
    data = merged.read_bytes()
    merged.write_bytes(data[: len(data) // 2])
    assert cli.run(["recover", str(merged), "-o", str(tmp_path / "saved.mcap")]) in (0, 3)
    parts = taken_apart(tmp_path / "saved.mcap", tmp_path / "runs")
    assert [replayers.read(part).info for part in parts] == [replayers.read(source).info for source in SOURCES]


def test_notes_on_several_runs_go_to_each(merged: Path, tmp_path: Path):
    assert cli.run(["log", "note", str(merged), "all three", "--at", "1"]) == 0
    for part in taken_apart(merged, tmp_path / "runs"):
        (note,) = messages(part, topics="/notes".__eq__)
        assert b"all three" in note.data


def test_parts_of_one_recording_are_one_run(tmp_path: Path):
    one, other = write_toy_log(tmp_path / "one.mcap"), tmp_path / "other.mcap"
    write_toy_log(other)
    assert cli.run(["log", "split", str(one), "-o", str(tmp_path / "p.mcap"), "--every", "5"]) == 0
    parts = sorted(tmp_path.glob("p_*.mcap"))
    assert runs_of([*parts, other, one]) == [*([0] * len(parts)), 1, 2]
    everything_of_it = [*map(str, parts), str(other)]
    assert cli.run(["log", "merge", *everything_of_it, "-o", str(tmp_path / "all.mcap"), "--runs"]) == 0
    again = taken_apart(tmp_path / "all.mcap", tmp_path / "runs")
    assert len(again) == 2
    assert everything(again[0])[0] == everything(one)[0]
    assert cli.run(["doctor", str(again[0])]) == 0


def test_a_log_of_one_run_is_one_file(tmp_path: Path):
    log = write_toy_log(tmp_path / "a.mcap")
    (part,) = taken_apart(log, tmp_path / "runs")
    assert everything(part)[0] == everything(log)[0]


def test_what_cannot_be_merged_or_split_so_is_refused(
    merged: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    out = str(tmp_path / "x.mcap")
    assert cli.run(["log", "merge", str(merged), str(SOURCES[0]), "-o", out, "--runs"]) == 2
    assert "split --by run" in capsys.readouterr().err
    assert cli.run(["log", "merge", *map(str, SOURCES), "-o", out]) == 2
    assert "--runs" in capsys.readouterr().err
    assert cli.run(["log", "split", str(merged), "-o", out, "--by", "run", "--every", "3"]) == 2
    assert cli.run(["log", "split", str(merged), "-o", out, "--by", "day"]) == 2
    assert cli.run(["log", "split", str(merged), "-o", out]) == 2
    assert not list(tmp_path.glob("x*")), "nothing is left"


def test_an_export_of_what_holds_no_run_leaves_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    from recorders.mcap_io.writer import McapWriter

    McapWriter(tmp_path / "empty.mcap").close()
    assert cli.run(["export", str(tmp_path / "empty.mcap"), "-o", str(tmp_path / "deep" / "tables")]) == 2
    assert "holds no run" in capsys.readouterr().err
    assert not (tmp_path / "deep" / "tables").exists()
