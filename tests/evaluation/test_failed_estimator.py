"""An estimator that fails ends an evaluation: one line, exit code 2, and no table of runs without beliefs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from workbench.cli import run as lios

MODULE = """
from workbench.beliefs.estimators import estimator


class Raises:
    name = "raises@1"

    def believe(self, knowledge, item_types):
        raise RuntimeError("no belief today")


class FailsLater:
    name = "later@1"
    asked = 0

    def believe(self, knowledge, item_types):
        FailsLater.asked += 1
        if FailsLater.asked > 30:
            raise RuntimeError("no belief any more")
        return estimator("counts").believe(knowledge, item_types)
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "failing_estimators.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("words", [
    "tasks -s conditioned-lios -n 1 --scenarios deliver-2",
    "search --policies conditioned-lios",
    "tasks --memory -s conditioned-lios -n 2 --scenarios find",
    "search --memory --policies conditioned-lios",
    "replay --scenarios find -n 1 -s greedy,lios",
    "select -s greedy,lios -n 2 --pool 2 --scenario find --seeds 2 --proofs 2",
])  # fmt: skip
def test_it_is_one_line_that_names_the_estimator(
    words: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert lios(["evaluate", *words.split(), "--estimator", "failing_estimators:Raises", "--json"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    (line,) = said.err.splitlines()
    assert line.startswith("lios: estimator 'raises@1': it raised RuntimeError: no belief today.")


def test_what_was_measured_before_is_kept(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wish = ["evaluate", "tasks", "-s", "conditioned-lios", "-n", "20", "--scenarios", "find", "-o", "out",
            "--estimator", "failing_estimators:FailsLater"]  # fmt: skip
    assert lios(wish) == 2
    assert "no belief any more" in capsys.readouterr().err
    kept = [json.loads(line) for path in (folder / "out").glob("*.jsonl") for line in path.read_text().splitlines()]
    assert any(row.get("status") == "done" for row in kept)
    assert not any(row.get("status") == "estimator-failed" for row in kept)


@pytest.mark.slow
def test_the_simulated_spot_ends_so_too_and_its_log_stays(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wish = ["evaluate", "spot", "-c", "A", "-s", "conditioned-lios", "-o", "out", "--images-hz", "0", "--json"]
    assert lios([*wish, "--estimator", "failing_estimators:Raises"]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.splitlines()[-1].startswith("lios: estimator 'raises@1': it raised RuntimeError")
    assert list((folder / "out").glob("*.mcap"))
