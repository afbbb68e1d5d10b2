"""Cross-validation: every house is evaluated once, by an estimator that was trained without it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from workbench.beliefs.training.train import TrainingSet
from workbench.cli import run
from workbench.evaluation.beliefs import cross_validation, fold_training
from workbench.worlds.procthor.load import load_houses
from workbench.worlds.shipped import shipped_houses


def test_no_house_is_judged_by_what_learnt_from_it(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    learnt: list[set[str]] = []
    judged: list[set[str]] = []
    train, judge = fold_training.train, cross_validation.evaluate_estimator

    def trained(name: str, lesson: TrainingSet, path: Path) -> Any:
        learnt.append({h.plan.name for h in (*lesson.houses, *lesson.held_out)})
        return train(name, lesson, path)

    def asked(estimator: Any, houses: Any, **how: Any) -> Any:
        judged.append({h.plan.name for h in houses})
        return judge(estimator, houses, **how)

    monkeypatch.setattr(fold_training, "train", trained)
    monkeypatch.setattr(cross_validation, "evaluate_estimator", asked)
    assert run(["evaluate", "belief", "--folds", "3", "-e", "counts", "--json"]) == 0
    answer = json.loads(capfd.readouterr().out)
    assert len(learnt) == len(judged) == 3
    assert all(not a & b for a, b in zip(learnt, judged, strict=True))
    names = [h.plan.name for h in load_houses(shipped_houses())]
    assert answer["houses"] == len(set().union(*judged)) == sum(len(part) for part in judged)
    assert 0.85 * len(names) < answer["houses"] < len(names), "those that say when to stop are not judged"
    row = answer["rows"][0]
    assert row["name"] == "counts, 3 folds"
    assert answer["split"] == "train, 3 folds"
    assert 0.2 < row["top1"] < 1


def test_houses_learnt_from_only_are_in_every_training(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    lines = tmp_path / "others.jsonl"
    made = ["houses", "generate", "--count", "4", "--seed", "7", "-o", str(lines)]
    assert run(made) == 0
    capfd.readouterr()
    sizes: list[int] = []
    train = fold_training.train

    def trained(name: str, lesson: TrainingSet, path: Path) -> Any:
        sizes.append(sum(h.plan.name.startswith("others:") for h in lesson.houses))
        return train(name, lesson, path)

    monkeypatch.setattr(fold_training, "train", trained)
    wanted = ["evaluate", "belief", "--folds", "2", "--also", str(lines), "-e", "counts", "--json"]
    assert run(wanted) == 0
    assert sizes == [3, 3], "one of four is held out"
    assert json.loads(capfd.readouterr().out)["also"] == [str(lines)]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--folds", "1"], "--folds is 1"),
        (["--folds", "1000"], "the number of houses to learn from"),
        (["--folds", "2", "-e", "bset"], "Did you mean: best"),
        (["--folds", "2", "-e", "mine.safetensors"], "estimator to train"),
        (["--folds", "2", "--figures", "out"], "without --folds"),
        (["--folds", "2", "--also", "no.jsonl"], "no such file"),
        (["--also", "no.jsonl"], "used with --folds"),
        (["--folds", "2", "--also", str(shipped_houses())], "disjoint from the evaluated houses"),
    ],
)
def test_bad_usage_is_one_line(arguments: list[str], said: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", "belief", *arguments]) == 2
    captured = capfd.readouterr()
    assert said in captured.err.replace("\n", " ")
    assert captured.out == ""
