"""Selection of cells by an expression, as pytest's -k does it."""

from __future__ import annotations

import json

import pytest

from workbench.cli import run
from workbench.errors import BadValue
from workbench.evaluation.tasks.cell_filter import cell_filter

CELLS = [(s, n) for s in ("deliver-3", "coffee", "breakfast+coffee") for n in ("opt-greedy", "model-lios", "oracle")]


@pytest.mark.parametrize(
    ("expression", "count"),
    [
        ("", 9),
        ("deliver", 3),
        ("Deliver-3", 3),
        ("coffee and greedy", 2),
        ("coffee and not greedy", 4),
        ("deliver or oracle", 5),
        ("deliver and greedy or oracle", 4),
        ("deliver and (greedy or oracle)", 2),
        ("not (coffee or deliver)", 0),
        ("not not deliver", 3),
        ("breakfast+coffee/model-lios", 1),
    ],
)
def test_cells_meant(expression: str, count: int) -> None:
    meant = cell_filter(expression)
    assert sum(meant(*cell) for cell in CELLS) == count


@pytest.mark.parametrize("expression", ["and", "deliver and", "(deliver", "deliver)", "not", "deliver greedy", "()"])
def test_what_cannot_be_read_is_refused(expression: str) -> None:
    with pytest.raises(BadValue, match="-k is"):
        cell_filter(expression)


def test_the_command_lists_the_cells_that_are_meant(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["evaluate", "tasks", "--scenarios", "any-of-three,deliver-2", "-n", "2", "--dry-run", "--json"]
    assert run([*words, "-k", "deliver and not lios"]) == 0
    cells = json.loads(capsys.readouterr().out)["cells"]
    assert [(c["scenario"], c["strategy"], c["trials"]) for c in cells] == [
        ("deliver-2", "opt-greedy", 2),
        ("deliver-2", "pes-greedy", 2),
        ("deliver-2", "oracle", 2),
    ]
    assert run([*words, "-k", "nobody"]) == 2
    assert "an expression that selects a cell" in capsys.readouterr().err


def test_only_the_cells_that_are_meant_are_run(capsys: pytest.CaptureFixture[str]) -> None:
    words = "evaluate tasks --scenarios any-of-three -s opt-greedy -n 1 --estimator counts --paper-estimator counts"
    assert run([*words.split(), "-k", "greedy", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [(r["scenario"], r["strategy"], r["trials"]) for r in rows] == [("any-of-three", "opt-greedy", 1)]


@pytest.mark.parametrize("expression", ["(" * 5000, "not " * 5000 + "x", " or ".join("x" * 5000)])
def test_an_expression_without_end_is_refused(expression: str) -> None:
    with pytest.raises(BadValue, match="at most 200 words"):
        cell_filter(expression)
