"""Searches and tasks by folds: every house is evaluated with weights that were trained without it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from workbench.beliefs import estimators
from workbench.beliefs.training.train import TrainingSet
from workbench.beliefs.weights import read_weights
from workbench.cli import run
from workbench.evaluation.beliefs import fold_training
from workbench.evaluation.search import experiment as search_experiment
from workbench.evaluation.tasks import trials as task_trials
from workbench.evaluation.tasks.rows import read_rows
from workbench.plugins import NameOrigin

SEARCH = ["evaluate", "search", "-p", "lios,conditioned-lios", "--queries", "12", "--no-figures", "--json"]
TASKS = ["evaluate", "tasks", "--scenarios", "any-of-three", "-s", "model-lios", "-n", "20", "--json"]
COUNTS = ["--estimator", "counts", "--paper-estimator", "counts"]


@pytest.fixture
def lessons(monkeypatch: pytest.MonkeyPatch) -> dict[str, set[str]]:
    """Of every weights file that is trained: the houses that it learnt from."""
    told: dict[str, set[str]] = {}
    train = fold_training.train

    def trained(name: str, lesson: TrainingSet, path: Path) -> Any:
        weights = train(name, lesson, path)
        told[weights.sha256] = {h.plan.name for h in (*lesson.houses, *lesson.held_out)}
        return weights

    monkeypatch.setattr(fold_training, "train", trained)
    return told


def test_searches_ask_weights_that_never_saw_the_house(
    lessons: dict[str, set[str]], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    asked: list[tuple[str, str]] = []
    house_trials = search_experiment.house_trials

    def watched(house: Any, travel: Any, *, estimators: Any, **how: Any) -> Any:
        def told(policy: str) -> Any:
            chosen = estimators(policy)
            asked.append((house.plan.name, chosen.name))
            return chosen

        return house_trials(house, travel, estimators=told, **how)

    monkeypatch.setattr(search_experiment, "house_trials", watched)
    assert run([*SEARCH, *COUNTS, "--folds", "3"]) == 0
    answer = json.loads(capfd.readouterr().out)
    by_name = {f"counts@{sha256[:8]}": houses for sha256, houses in lessons.items()}
    assert len(by_name) == 3
    assert len(asked) >= 12, "two policies in several houses"
    assert {name for _, name in asked} == set(by_name), "every fold was met"
    assert all(house not in by_name[name] for house, name in asked)
    assert answer["split"] == "train, 3 folds"
    assert {row["policy"] for row in answer["looks"]} == {"lios", "conditioned-lios"}


def test_tasks_ask_weights_that_never_saw_the_house_and_keep_them(
    lessons: dict[str, set[str]], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run([*TASKS, *COUNTS, "--folds", "3", "-o", str(tmp_path)]) == 0
    answer = json.loads(capfd.readouterr().out)
    assert answer["split"] == "train, 3 folds"
    weights = sorted((tmp_path / "weights").iterdir())
    assert [path.name for path in weights] == [f"counts-{k}-of-3.safetensors" for k in range(3)]
    learnt = {(held := read_weights(path)).name: lessons[held.sha256] for path in weights}
    rows = read_rows(tmp_path / "trials.jsonl")
    assert len(rows) == 40
    assert {row.estimator for row in rows} == set(learnt), "every fold was met"
    assert all(row.house not in learnt[row.estimator] for row in rows)
    assert answer["rows"][0]["estimator"] == "counts (3 sets of weights)"

    lessons.clear()
    torn = weights[1].read_bytes()
    weights[1].write_bytes(torn[: len(torn) // 2])
    assert (
        run([*(word if word != "20" else "21" for word in TASKS), *COUNTS, "--folds", "3", "-o", str(tmp_path)]) == 0
    )
    assert len(lessons) == 1, "two of three sets are kept, the torn one is trained again"
    assert weights[1].read_bytes() == torn
    capfd.readouterr()


@pytest.mark.ci
def test_another_number_of_folds_is_another_evaluation(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run([*TASKS, *COUNTS, "-o", str(tmp_path)]) == 0
    assert run([*TASKS, *COUNTS, "--folds", "2", "-o", str(tmp_path)]) == 2
    assert "another evaluation" in capfd.readouterr().err


@pytest.mark.ci
def test_weights_of_other_houses_are_not_kept(
    lessons: dict[str, set[str]], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A folder of searches may be written over with other houses; its weights are then trained anew."""
    made = ["houses", "generate", "--count", "6", "--seed", "7", "-o", str(tmp_path / "others.jsonl")]
    assert run(made) == 0
    folds = [*COUNTS, "--folds", "2", "-o", str(tmp_path / "out"), "--force"]
    for file in ("", str(tmp_path / "others.jsonl")):
        houses = ["--houses", file] if file else []
        assert run([*SEARCH, *folds, *houses]) == 0
    assert len(lessons) == 4
    assert sum(all(h.startswith("others:") for h in learnt) for learnt in lessons.values()) == 2
    capfd.readouterr()


@pytest.mark.parametrize("command", [SEARCH, TASKS])
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--folds", "1"], "--folds is 1"),
        (["--folds", "1000", *COUNTS], "the number of houses to learn from"),
        (["--folds", "2", "--estimator", "mine.safetensors"], "estimator to train"),
        (["--also", "no.jsonl"], "used with --folds"),
    ],
)
def test_bad_usage_is_one_line(
    command: list[str], arguments: list[str], said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run([*command, *arguments]) == 2
    captured = capfd.readouterr()
    assert said in captured.err.replace("\n", " ")
    assert captured.out == ""


def test_a_weights_file_is_read_once_for_many_trials(tmp_path: Path) -> None:
    path = tmp_path / "mine.safetensors"
    path.write_bytes(estimators.shipped_weights("counts").read_bytes())
    first = task_trials.estimator_named(str(path), origin=NameOrigin.USER)
    assert task_trials.estimator_named(str(path), origin=NameOrigin.USER) is first
    path.write_bytes(estimators.shipped_weights("fcnn").read_bytes())
    assert task_trials.estimator_named(str(path), origin=NameOrigin.USER).name.startswith("fcnn@")


def test_weights_trained_beforehand_are_those_of_the_evaluation(
    lessons: dict[str, set[str]], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """`lios train --folds` makes what an evaluation with the same folds would make, which then uses it."""
    houses = ["--houses", str(tmp_path / "mine.jsonl")]
    assert run(["houses", "generate", "--count", "6", "--seed", "7", "-o", houses[1]]) == 0
    made = ["train", *houses, "-e", "counts", "--folds", "3", "-o", str(tmp_path / "out" / "weights"), "--json"]
    capfd.readouterr()
    assert run(made) == 0
    files = json.loads(capfd.readouterr().out)["files"]
    assert [Path(file).name for file in files] == [f"counts-{k}-of-3.safetensors" for k in range(3)]
    assert len(lessons) == 3
    lessons.clear()
    assert run(made) == 0
    assert run([*SEARCH, *COUNTS, *houses, "--folds", "3", "-o", str(tmp_path / "out"), "--force"]) == 0
    assert not lessons
    assert run([*made, "--force"]) == 0
    assert len(lessons) == 3
    capfd.readouterr()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--folds", "1"], "--folds is 1"),
        (["--also", "other.jsonl"], "used with --folds"),
        (["--folds", "3", "--houses", "other.jsonl"], "one file with --folds"),
        (["--folds", "3", "-e", "encoder"], "estimator to train"),
        (["--scheduler", "local"], "given with --folds"),
    ],
)
def test_training_for_folds_refuses_in_one_line(
    arguments: list[str], said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert run(["train", "--houses", "mine.jsonl", *arguments]) == 2
    assert said in capfd.readouterr().err.replace("\n", " ")
