"""The memory experiment on tasks, through the command line."""

from __future__ import annotations

import json

import pytest

from workbench.cli import run as lios


@pytest.mark.slow
def test_the_command_prints_the_table_of_tasks(capsys: pytest.CaptureFixture[str]) -> None:
    said = ["evaluate", "tasks", "--memory", "--scenarios", "deliver-2", "-s", "opt-lios", "-n", "2"]
    assert lios([*said, "--estimator", "counts", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert len(rows) == 4
    assert {row["strategy"] for row in rows} == {"opt-lios"}
    assert all(row["cost_oracle"] <= row["cost_without"] + 1e-9 for row in rows)
    last_but_one = rows[2]
    assert last_but_one["saved"] == pytest.approx(0.0, abs=0.03), "after two months nothing is remembered"
    assert lios([*said, "--dry-run"]) == 2
