"""Third-party strategies: a failure ends the run with a status, and the command's output stays clean."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from replayers.runs.run import read
from workbench.cli import run
from workbench.planning.composed import Composed
from workbench.planning.strategies import StrategyNotLoaded, strategy
from workbench.plugins import NameOrigin


@pytest.fixture(autouse=True)
def _found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parent))


def _recorded(name: str, folder: Path, capsys: pytest.CaptureFixture[str], *more: str) -> dict[str, object]:
    words = ["record", *(more or ("--find", "mug")), "-s", f"unruly:{name}", "--estimator", "counts"]
    code = run([*words, "-o", str(folder / "run.mcap"), "--json"])
    said = capsys.readouterr()
    answer = json.loads(said.out)
    assert code == (1 if answer["status"] == "planner-failed" else 0), said.err
    return answer


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("Raises", "it raised RuntimeError: no idea"),
        ("Exits", "it raised SystemExit: 0"),
        ("AnswersNothing", "it returned nothing instead of a Decision"),
        ("AnswersText", "its plan is of type str, not a Plan"),
        ("StepsOfText", "its plan's steps are not a tuple of PlanStep"),
        ("CostsNoNumber", "its plan's cost is not a finite number"),
        ("NeverActs", "steps_now is 0; it must be at least 1"),
        ("TypesRaise", "it raised KeyError: 'types'"),
        ("TypesAreNothing", "its relevant_types are nothing, not a tuple of item types"),
    ],
)
def test_what_it_does_wrong_is_the_reason_of_a_failed_run(
    name: str, why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = _recorded(name, tmp_path, capsys)
    assert answer["status"] == "planner-failed"
    assert why in str(answer["reason"])
    logged = read(tmp_path / "run.mcap").outcome
    assert logged is not None
    assert logged.reason == answer["reason"], "the log is complete"


def test_one_that_never_ends_is_out_of_the_planning_budget(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    task = tmp_path / "short.yaml"
    task.write_text("budget_s: 0.3\ngoal: {deliver: Mug, to: start}\n")
    answer = _recorded("NeverEnds", tmp_path, capsys, "--task", str(task))
    assert answer["status"] == "out-of-planning-budget"


def test_what_it_prints_is_not_in_the_answer(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _recorded("Prints", tmp_path, capsys)["status"] == "done"


@pytest.mark.parametrize("name", ["CannotBeMade", "WantsMore"])
def test_one_that_cannot_be_made_is_bad_input(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code = run(["record", "--find", "mug", "-s", f"unruly:{name}", "-o", str(tmp_path / "run.mcap")])
    assert code == 2
    assert "cannot be loaded" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_a_module_that_raises_is_bad_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "broken_planner.py").write_text("def f(:\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(StrategyNotLoaded, match="SyntaxError"):
        strategy("broken_planner:Planner", origin=NameOrigin.USER)


def test_ours_put_together_by_a_stranger_is_left_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own_parts.py").write_text(
        "from workbench.planning.strategies import strategy\ndef make(house):\n    return strategy('lios')\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    assert isinstance(strategy("own_parts:make", origin=NameOrigin.USER), Composed), "lios plan can show its PDDL"
