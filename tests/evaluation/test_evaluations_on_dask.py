"""Searches, selections and trainings on a Dask cluster of two workers: the same bytes as in this process."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from workbench.cli import run

pytest.importorskip("distributed", reason="dask.distributed is not installed")
pytestmark = [pytest.mark.filterwarnings("ignore"), pytest.mark.slow]

CLUSTER = ("-j", "2", "--scheduler", "local")


def without_times(value: Any) -> Any:
    """An answer without what depends on the machine."""
    if isinstance(value, dict):
        kept = {key: part for key, part in value.items() if key not in ("seconds", "workers", "ms_a_decision")}
        return {key: without_times(part) for key, part in kept.items()}
    return [without_times(part) for part in value] if isinstance(value, list) else value


def files_in(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_searches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["new", "policy", "mine"]) == 0
    capsys.readouterr()
    words = ["evaluate", "search", "-p", "lios,mine:Mine", "--queries", "10", "--folds", "2", "--no-figures"]
    words += ["--estimator", "counts", "--paper-estimator", "counts", "--json"]
    answers = []
    for name, on in (("here", ()), ("there", CLUSTER), ("processes", ("-j", "2"))):
        assert run([*words, *on, "-o", name]) == 0
        answers.append(without_times(json.loads(capsys.readouterr().out)))
    assert answers[0] == answers[1] == answers[2]
    assert files_in(tmp_path / "here" / "weights") == files_in(tmp_path / "there" / "weights")
    assert len(files_in(tmp_path / "there" / "weights")) == 2
    assert not (tmp_path / "there" / "houses.jsonl").exists(), "kept while it is not complete"


def test_selections_which_go_on_where_they_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = [
        "evaluate",
        "select",
        "-s",
        "opt-greedy,pes-greedy",
        "--scenario",
        "any-of-three",
        "--pool",
        "4",
        "-n",
        "3",
    ]
    words += ["--seeds", "2", "--proofs", "2", "--worlds", "4", "--json"]
    assert run([*words, "-o", "here"]) == 0
    here = capsys.readouterr().out
    assert run([*words, *CLUSTER, "-o", "there"]) == 0
    assert capsys.readouterr().out == here
    pool = (tmp_path / "here" / "pool.jsonl").read_bytes()
    assert (tmp_path / "there" / "pool.jsonl").read_bytes() == pool
    lines = pool.splitlines(keepends=True)
    (tmp_path / "there" / "pool.jsonl").write_bytes(b"".join([lines[2], lines[0]]))
    assert run([*words, *CLUSTER, "-o", "there"]) == 0
    assert capsys.readouterr().out == here
    assert (tmp_path / "there" / "pool.jsonl").read_bytes() == pool


def test_trainings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["houses", "generate", "--count", "9", "--seed", "3", "-o", "mine.jsonl"]) == 0
    words = ["train", "--houses", "mine.jsonl", "-e", "counts", "--folds", "3"]
    assert run([*words, "-o", "here"]) == 0
    assert run([*words, *CLUSTER, "-o", "there"]) == 0
    assert run([*words, "-j", "2", "-o", "processes"]) == 0
    assert files_in(tmp_path / "here") == files_in(tmp_path / "there") == files_in(tmp_path / "processes")
    capsys.readouterr()
