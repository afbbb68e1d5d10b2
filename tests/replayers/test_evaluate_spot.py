"""The paper's experiment on the simulated robot, small: one configuration, two strategies, replayed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from replayers.runs.run import read
from workbench.cli import run


@pytest.mark.ci
def test_evaluate_spot_answers_rows_and_keeps_logs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["evaluate", "spot", "-c", "A", "-s", "PesGreedy,conditioned-lios", "--estimator", "counts"]
    assert run([*arguments, "-o", str(tmp_path), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    rows = {row["strategy"]: row for row in answer["rows"]}
    greedy, ours = rows["pes-greedy"], rows["conditioned-lios"]
    assert greedy["status"] == ours["status"] == "done"
    assert (greedy["searches"], greedy["paper_searches"], greedy["paper_seconds"]) == (9, 9, 311)
    assert ours["searches"] < greedy["searches"]
    assert ours["seconds"] < greedy["seconds"]
    assert ours["paper_seconds"] is None
    assert answer["inside_bounds"] == 1.0
    logs = sorted(tmp_path.glob("*.mcap"))
    assert [log.name for log in logs] == ["spot_A_conditioned-lios.mcap", "spot_A_pes-greedy.mcap"]
    assert all(log.stat().st_size < 1_000_000 for log in logs)
    assert all(read(log).complete for log in logs)
    assert run([*arguments, "-o", str(tmp_path)]) == 2, "logs are not overwritten"


@pytest.mark.slow
def test_all_four_configurations_end_done_and_within_one_anothers_bounds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["evaluate", "spot", "-o", str(tmp_path), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert len(answer["rows"]) == 16
    assert {row["status"] for row in answer["rows"]} == {"done"}
    assert len(answer["replayed"]) == 48
    assert answer["inside_bounds"] == 1.0
