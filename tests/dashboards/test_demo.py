"""`lios demo --no-view`: the whole demonstration, twice into the same folder."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from replayers.runs.run import read
from workbench import cli
from workbench.planning.strategies import strategy_names


def test_the_demo_records_replays_and_compares(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "a demo"
    assert cli.run(["demo", "--json", "-o", str(folder)]) == 0
    answer = json.loads(capsys.readouterr().out)
    rows = {row["strategy"]: row for row in answer["rows"]}
    assert set(rows) == set(strategy_names(with_truth=True))
    assert answer["status"] == "done"
    assert rows["model-lios"]["exact"], "the recorded strategy is certain of its own cost"
    assert rows["model-lios"]["lower"] == pytest.approx(answer["cost"], abs=1e-4)
    for row in answer["rows"]:
        if row["lower"] is not None:
            assert row["lower"] - 1e-6 <= row["in_truth"] <= row["upper"] + 1e-6
        assert rows["oracle"]["in_truth"] <= row["in_truth"] + 1e-6
    assert read(folder / "run.mcap").complete


@pytest.mark.ci
def test_the_demo_can_be_run_again_and_names_what_to_look_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for _ in range(2):
        assert cli.run(["demo", "--no-view", "-o", str(tmp_path)]) == 0
        said = capsys.readouterr()
        words = said.err.strip().splitlines()[-1].split("lios view ")[1].split()
        assert len(words) == 4
        assert all(Path(word).exists() for word in words)
        assert "opt-greedy" in said.out
