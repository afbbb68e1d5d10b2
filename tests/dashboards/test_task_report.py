"""`lios report`: a page of what its folder holds, and of nothing else."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from dashboards import task_report
from workbench.cli import run
from workbench.evaluation.tasks.rows import read_rows

COUNTS = ["--estimator", "counts", "--paper-estimator", "counts"]
WORDS = ["evaluate", "tasks", "--scenarios", "any-of-three", "-s", "model-lios", "-n", "2", *COUNTS]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report") / "out"
    assert run([*WORDS, "--record", "-o", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def written(recorded: Path) -> tuple[str, list[Path]]:
    """The page's text and the figures."""
    page, figures = task_report.write_report(recorded)
    return page.read_text(), figures


@pytest.mark.ci
def test_an_example_is_drawn_of_a_recorded_trial(written: tuple[str, list[Path]]) -> None:
    _, figures = written
    assert [path.name for path in figures if path.name.startswith("example")] == ["example_any-of-three.png"]


@pytest.mark.ci
def test_logs_of_another_evaluation_in_the_folder_are_no_example(
    recorded: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """--force begins again without --record: the logs of before stay, and their trials are others."""
    other = tmp_path / "out"
    assert run([*WORDS, "--seed", "7", "-o", str(other)]) == 0
    os.symlink(recorded / "logs", other / "logs")
    _, figures = task_report.write_report(other)
    assert not [path for path in figures if path.name.startswith("example")]


def test_a_row_that_stands_twice_counts_once(recorded: Path, written: tuple[str, list[Path]]) -> None:
    once, _ = written
    trials = recorded / "trials.jsonl"
    rows, text = read_rows(trials), trials.read_bytes()
    try:
        trials.write_bytes(text + text)
        page, _ = task_report.write_report(recorded)
        assert page.read_text() == once
    finally:
        trials.write_bytes(text)
    assert len(rows) == 4


def test_an_evaluation_without_a_trial_is_one_line(recorded: Path, capsys: pytest.CaptureFixture[str]) -> None:
    trials = recorded / "trials.jsonl"
    text = trials.read_bytes()
    try:
        trials.write_bytes(b"")
        assert run(["report", str(recorded)]) == 2
    finally:
        trials.write_bytes(text)
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "holds no trial" in said


def test_the_costs_stand_on_a_page_without_scrolling_sideways(written: tuple[str, list[Path]]) -> None:
    text, _ = written
    assert "white-space: nowrap" in text
    assert "<table class=costs><tr><th rowspan=2>Strategy</th><th colspan=3>Any-of-Three</th>" in text
