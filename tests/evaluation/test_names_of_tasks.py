"""Names of scenarios and strategies in tables, figures and files: readable, faithful, and unique."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

from workbench.evaluation.figures.style import new_figure
from workbench.evaluation.figures.task_bars import STRATEGY_COLOURS, draw_task_bars, strategy_styles
from workbench.evaluation.tasks.names import scenario_file_name, scenario_title, shortened, strategy_title
from workbench.evaluation.tasks.table import markdown

PLANNER = "command:/opt/$HOME/planner {domain} {problem} {plan} | tee $x"


def line(scenario: str, strategy: str) -> dict[str, object]:
    return {"scenario": scenario, "strategy": strategy, "mean_cost": 5.0, "ci95": [4.0, 6.0], "success_rate": 1.0}


def test_titles() -> None:
    assert scenario_title("deliver-3") == "Deliver 3-Object"
    assert scenario_title("a/tea.yaml") == "a/tea.yaml"
    assert strategy_title("model-lios") == "ModelLIOS"
    assert strategy_title("model-lios@everywhere") == "ModelLIOS@everywhere"
    assert strategy_title("my.module:Planner") == "my.module:Planner"


def test_long_titles_are_shortened_in_their_middle() -> None:
    assert shortened("short", 5) == "short"
    assert shortened("a long path/tea.yaml", 12) == "a l…tea.yaml"
    assert len(shortened("x" * 100, 30)) == 30


def test_file_names_differ_and_fit() -> None:
    names = [
        "deliver-3",
        "tea.yaml",
        "a/tea.yaml",
        "b/tea.yaml",
        f"model-lios@{PLANNER}",
        f"lios@{PLANNER}",
        "x" * 999,
    ]
    files = [scenario_file_name(name) for name in names]
    assert len(set(files)) == len(files)
    assert all(len(file) < 120 and "/" not in file for file in files)
    assert files[0] == "deliver-3"


def test_no_two_strategies_look_alike() -> None:
    names = [*STRATEGY_COLOURS, "model-lios@a", "model-lios@b", *(f"mine:Planner{i}" for i in range(40))]
    looks = strategy_styles(names)
    assert len(set(looks.values())) == len(names)
    assert looks["model-lios"] == (STRATEGY_COLOURS["model-lios"], "")


@pytest.mark.parametrize("scenarios", [1, 8])
def test_names_with_dollars_are_drawn_as_they_are(scenarios: int, tmp_path: Path) -> None:
    figure, (ax,) = new_figure(7.2, 3.2)
    lines = [line(f"a$x_{{$c{i}.yaml", f"model-lios@{PLANNER}") for i in range(scenarios)]
    draw_task_bars(ax, lines)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure.savefig(tmp_path / "bars.png")


def test_a_table_in_markdown_keeps_its_columns() -> None:
    rows = markdown([line("find", f"lios@{PLANNER}")]).splitlines()  # type: ignore[arg-type]
    assert [row.replace("\\|", "").count("|") for row in rows] == [4, 4, 4]
