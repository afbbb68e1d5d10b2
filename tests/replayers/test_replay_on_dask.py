"""Replays on a Dask cluster of two workers: the same bytes as in this process, also with a planner of one's own."""

from __future__ import annotations

from pathlib import Path

import pytest
from planner_file import write_planner

from workbench import cli

pytest.importorskip("distributed", reason="dask.distributed is not installed")
pytestmark = pytest.mark.filterwarnings("ignore")

LOGS = Path(__file__).resolve().parents[2] / "logs"


def files_in(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_two_workers_write_what_this_process_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_planner(tmp_path / "my_planner.py")
    logs = [str(LOGS / f"{name}.mcap") for name in ("find-lios", "spot-home-B")]
    words = ["replay", *logs, "-s", "model-lios,my_planner:Mine", "--worlds", "10", "--json"]
    assert cli.run([*words, "-j", "1", "-o", "here"]) == 0
    here = capsys.readouterr().out
    assert cli.run([*words, "-j", "2", "--scheduler", "local", "-o", "there"]) == 0
    assert capsys.readouterr().out == here
    assert files_in(tmp_path / "there") == files_in(tmp_path / "here")
    assert len(files_in(tmp_path / "there")) == 8
    before = {path: path.stat().st_mtime_ns for path in (tmp_path / "there").rglob("model-lios*.json")}
    assert cli.run([*words, "-j", "2", "--scheduler", "local", "-o", "there"]) == 0
    assert before == {path: path.stat().st_mtime_ns for path in before}, "what is kept is not made again"


@pytest.mark.slow
def test_two_workers_measure_what_this_process_measures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["evaluate", "replay", "-s", "opt-greedy,pes-greedy", "-n", "6", "--scenarios", "find", "--worlds", "10"]
    words += ["--estimators", "counts", "--json"]
    assert cli.run([*words, "-o", "here.csv"]) == 0
    here = capsys.readouterr().out
    assert cli.run([*words, "-j", "2", "--scheduler", "local", "-o", "there.csv"]) == 0
    assert capsys.readouterr().out == here
    assert (tmp_path / "there.csv").read_bytes() == (tmp_path / "here.csv").read_bytes()


@pytest.mark.parametrize("option", ["--verify", "--in-process"])
def test_what_runs_in_this_process_takes_no_scheduler(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["replay", str(LOGS / "find-lios.mcap"), "--scheduler", "local", option]) == 2
    assert f"left out with {option}" in capsys.readouterr().err
