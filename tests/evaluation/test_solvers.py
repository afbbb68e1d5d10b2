"""`lios evaluate solvers`: rows by hand-checked problems, validated plans, refusals."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from problems import deliver_goal, random_problem

from workbench.cli import run
from workbench.evaluation.solvers import compare_solvers, plan_lines, validated
from workbench.planning.solvers.pddl import pddl_of
from workbench.planning.solvers.registry import solver

PROBLEM = random_problem(deliver_goal("Mug", "Book", "Pen"), ("Mug", "Book", "Pen"), seed=0)
"""Its optimum is 94, and the paper's search pays 116 (test_solvers_agree.py)."""


@pytest.mark.ci
def test_costs_are_over_the_optimum_and_plans_are_validated() -> None:
    rows = list(compare_solvers({"three": [PROBLEM]}, ("sas-blind", "sas-ff-astar2"), budget_s=30))
    assert [(row.solver, row.over_optimum) for row in rows] == [("sas-blind", 1.0), ("sas-ff-astar2", 1.234)]
    assert {row.statuses for row in rows} == {"solved 1"}
    assert {row.valid for row in rows} == {"1 of 1"}
    assert all(row.seconds > 0 for row in rows)


@pytest.mark.ci
def test_a_plan_that_is_cut_or_foreign_is_not_valid() -> None:
    plan = solver("sas-blind").solve(PROBLEM, budget_s=30).plan
    assert validated(PROBLEM, plan)
    assert not validated(PROBLEM, replace(plan, steps=plan.steps[:-1]))
    foreign = replace(plan, steps=(replace(plan.steps[0], action="fly"), *plan.steps[1:]))
    assert plan_lines(foreign, pddl_of(PROBLEM)) is None
    assert not validated(PROBLEM, foreign)


@pytest.mark.slow
def test_the_command_by_its_json(capsys: pytest.CaptureFixture[str]) -> None:
    words = [
        "evaluate",
        "solvers",
        "--scenarios",
        "deliver-3",
        "--solvers",
        "built-in,sas-blind",
        "-n",
        "1",
        "--json",
    ]
    assert run(words) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [row["solver"] for row in answer["rows"]] == ["built-in", "sas-blind"]
    assert all(row["over_optimum"] == 1.0 and row["valid"] == "1 of 1" for row in answer["rows"])
    assert answer["versions"]["unified-planning"]


@pytest.mark.parametrize("names", ["no-such-solver", "up-no-such-engine", ","])
def test_unknown_solvers_are_refused_before_anything_is_planned(names: str) -> None:
    assert run(["evaluate", "solvers", "--solvers", names]) == 2
