"""`evaluate` from Python: the rows of the commands, as data frames."""

from __future__ import annotations

import json

import pytest

from workbench.cli import run
from workbench.errors import BadValue
from workbench.evaluation import BeliefRequest, SearchRequest, TaskRequest, evaluate


def commanded(capsys: pytest.CaptureFixture[str], words: str) -> list[dict[str, object]]:
    assert run(["evaluate", *words.split(), "--json"]) == 0
    return json.loads(capsys.readouterr().out)["rows"]


def without_times(rows: list[dict[str, object]]) -> list[dict[str, object]]:
    return [{k: v for k, v in row.items() if not k.endswith("_s") and not k.startswith("ms_")} for row in rows]


def test_searches(capsys: pytest.CaptureFixture[str]) -> None:
    names = {"estimator": "counts", "paper_estimator": "counts"}
    made = evaluate(SearchRequest(policies=("lios",), queries="6", **names))
    words = "search -p lios --queries 6 --no-figures --estimator counts --paper-estimator counts"
    assert without_times(made.answer["rows"]) == without_times(commanded(capsys, words))
    assert list(made.frame["policy"]) == ["greedy", "lios", "oracle"]
    assert len(made.trial_frame) == 18
    mean = made.trial_frame.groupby("policy")["cost"].mean()
    assert mean["lios"] == pytest.approx(made.frame.set_index("policy")["mean_cost"]["lios"])


def test_beliefs(capsys: pytest.CaptureFixture[str]) -> None:
    made = evaluate(BeliefRequest(estimators=("counts",), part="test"))
    assert without_times(made.answer["rows"]) == without_times(
        commanded(capsys, "belief --estimators counts --split test")
    )
    assert made.trial_frame["top1"].mean() == pytest.approx(made.frame["top1"][0])
    with pytest.raises(BadValue, match="in this process"):
        evaluate(BeliefRequest(), workers=2)


def test_tasks(capsys: pytest.CaptureFixture[str]) -> None:
    names = {"estimator": "counts", "paper_estimator": "counts"}
    made = evaluate(TaskRequest(scenarios=("deliver-1",), strategies=("pes-greedy",), trials=2, **names))
    words = "tasks --scenarios deliver-1 -s pes-greedy -n 2 --estimator counts --paper-estimator counts"
    ours, theirs = (without_times(rows) for rows in (made.answer["rows"], commanded(capsys, words)))
    assert [row["mean_cost"] for row in ours] == [row["mean_cost"] for row in theirs]
    assert list(made.frame["strategy"]) == ["pes-greedy", "oracle"]
    assert list(made.trial_frame["strategy"]) == ["pes-greedy", "oracle"] * 2
