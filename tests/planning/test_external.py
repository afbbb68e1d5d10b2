"""PDDL names, the PDDL route, planners by command line, and misbehaving processes."""

from __future__ import annotations

import re
import sys
import time
from pathlib import Path

import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st
from problems import breakfast_goal, deliver_goal, random_problem

from workbench.cli import run
from workbench.errors import BadValue, MissingExtra, UnknownName
from workbench.planning.builtin.solver import solve
from workbench.planning.plans import PlanStatus
from workbench.planning.problem import holds, initial_state
from workbench.planning.solvers.external import PddlCommand
from workbench.planning.solvers.fast_downward import downward_home, read_plan
from workbench.planning.solvers.pddl import pddl_names, pddl_of
from workbench.planning.solvers.registry import PlannerMissing, installed_solver, solver
from workbench.planning.solvers.reserved_words import RESERVED
from workbench.planning.solvers.subprocess_limits import Exit, run_program
from workbench.planning.strategies import strategy
from workbench.plugins import NameOrigin

LOG = Path(__file__).resolve().parents[2] / "logs" / "find-lios.mcap"
CASES = [random_problem(deliver_goal("Mug", "Book"), ("Mug", "Book"), seed=seed) for seed in range(1, 6)]
CASE = next(case for case in CASES if not holds(case.goal, initial_state(case), case))


@given(st.lists(st.text(max_size=12), unique=True, max_size=12))
def test_names_are_legal_unique_and_mapped_back(ours: list[str]) -> None:
    names = pddl_names(ours)
    assert set(names) == set(ours)
    assert len(set(names.values())) == len(ours)
    for name in names.values():
        assert re.fullmatch(r"[a-z][a-z0-9_]*", name)
        assert name not in RESERVED


@pytest.mark.parametrize("name", ["pddl-lmcut", "pddl-ff-astar2", "sas-ff-astar2", "sas-anytime"])
def test_routes_give_legal_plans(name: str) -> None:
    case = random_problem(breakfast_goal, ("Egg", "Bowl", "Pot", "Apple", "Plate", "Knife"), seed=2, places=3)
    best = solve(case, max_nodes=10**6, polish_nodes=10**6).plan
    made = solver(name).solve(case, budget_s=20 if "anytime" not in name else 3).plan
    assert made.status is PlanStatus.SOLVED
    assert made.cost >= best.cost - 1e-6
    assert made.optimal == (name == "pddl-lmcut")
    if made.optimal:
        assert made.cost == pytest.approx(best.cost)


def test_a_strategy_takes_another_solver() -> None:
    assert strategy("model-lios@sas-lmcut").name == "model-lios@sas-lmcut"
    with pytest.raises(UnknownName, match="sas-lmcut"):
        strategy("model-lios@sas-lmcutt")


def test_a_plan_of_nonsense_is_none() -> None:
    steps = pddl_of(CASE).steps
    assert read_plan("(fly me to_the_moon)\n", steps, CASE) is None
    assert read_plan("; empty\n", steps, CASE) is None


def python_planner(tmp_path: Path, code: str) -> PddlCommand:
    script = tmp_path / "planner.py"
    script.write_text(f"import sys\ndomain, problem, plan = sys.argv[1:4]\n{code}\n")
    return PddlCommand(command=f"{sys.executable} {script} {{domain}} {{problem}} {{plan}}")


@pytest.mark.parametrize(
    ("code", "status", "said"),
    [
        ("import time; time.sleep(60)", PlanStatus.TIMED_OUT, "time limit"),
        ("import os; os.abort()", PlanStatus.SOLVER_FAILED, "crashed"),
        ("open(plan, 'w').write('(dance)')", PlanStatus.SOLVER_FAILED, "no plan that holds"),
        ("open(plan, 'wb').write(b'\\xff' * 5000)", PlanStatus.SOLVER_FAILED, "no plan that holds"),
        ("sys.exit(11)", PlanStatus.NO_PLAN, ""),
        ("print('out of luck'); sys.exit(3)", PlanStatus.SOLVER_FAILED, "out of luck"),
    ],
)
def test_planners_that_misbehave_are_a_status(tmp_path: Path, code: str, status: PlanStatus, said: str) -> None:
    made = python_planner(tmp_path, code).solve(CASE, budget_s=1 if status is PlanStatus.TIMED_OUT else 60).plan
    assert made.status is status
    assert said in made.note


def test_a_planner_of_one_s_own_by_its_command_line(tmp_path: Path) -> None:
    home = downward_home()
    assert home is not None
    search = "astar(blind())"
    planner = f"{sys.executable} {home / 'fast-downward.py'} --plan-file {{plan}} {{domain}} {{problem}}"
    made = PddlCommand(command=f"{planner} --search '{search}'").solve(CASE, budget_s=30).plan
    assert made.status is PlanStatus.SOLVED, made.note
    assert made.cost == pytest.approx(solve(CASE).plan.cost)
    assert not made.optimal


def test_a_planner_that_is_not_installed_says_so() -> None:
    made = PddlCommand(command="no-such-planner {domain} {problem} {plan}").solve(CASE, budget_s=5).plan
    assert made.status is PlanStatus.SOLVER_FAILED
    assert "no-such-planner" in made.note
    with pytest.raises(BadValue):
        PddlCommand(command="planner")
    with pytest.raises(BadValue, match="a shell can read: No closing quotation"):
        PddlCommand(command="planner 'of mine {domain} {problem} {plan}")


def test_memory_is_limited(tmp_path: Path) -> None:
    code = "x = bytearray(400 * 2**20)"
    answer = run_program([sys.executable, "-c", code], folder=tmp_path, time_s=20, memory_bytes=200 * 2**20)
    assert answer.exit in (Exit.ENDED, Exit.CRASHED)
    assert answer.code != 0


@pytest.mark.ci
def test_children_die_with_the_planner(tmp_path: Path) -> None:
    child = tmp_path / "child"
    code = (
        "import pathlib, subprocess, sys, time\n"
        "made = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])\n"
        f"pathlib.Path({str(child)!r}).write_text(str(made.pid))\n"
        "time.sleep(600)"
    )
    answer = run_program([sys.executable, "-c", code], folder=tmp_path, time_s=3.0)
    assert answer.exit is Exit.TIMED_OUT
    number = int(child.read_text())
    until = time.monotonic() + 60
    while psutil.pid_exists(number) and psutil.Process(number).status() != psutil.STATUS_ZOMBIE:
        assert time.monotonic() < until, "the planner's child is still there"
        time.sleep(0.02)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("command:no-such-planner {domain} {problem} {plan}", "there is no such program. Install the planner"),
        ("up-no-such-engine", "unified-planning has no such engine here. It has .*fast-downward"),
        ("up-", "unified-planning has no such engine here"),
    ],
)
def test_a_planner_that_is_not_installed_is_refused_by_name(name: str, said: str) -> None:
    """At once, and not by a table of failed runs."""
    with pytest.raises(PlannerMissing, match=said):
        installed_solver(name, origin=NameOrigin.USER)
    with pytest.raises(PlannerMissing, match=said):
        strategy(f"model-lios@{name}", origin=NameOrigin.USER)


@pytest.mark.parametrize("name", ["sas-blind", "pddl-ff-astar2"])
def test_without_fast_downward_its_names_say_what_to_install(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("workbench.planning.solvers.fast_downward.installed_module", lambda _: None)
    downward_home.cache_clear()
    try:
        for make in (installed_solver, strategy):
            asked = name if make is installed_solver else f"model-lios@{name}"
            with pytest.raises(MissingExtra, match=r"lios-workbench\[planners\]"):
                make(asked, origin=NameOrigin.USER)
        assert run(["plan", str(LOG), "--solver", name]) == 2
        made = solver(name).solve(CASE, budget_s=5).plan
    finally:
        downward_home.cache_clear()
    assert made.status is PlanStatus.SOLVER_FAILED
    assert "lios-workbench[planners]" in made.note
    said = f"lios: solver {name} needs an optional part. Install it: pip install 'lios-workbench[planners]'.\n"
    assert capsys.readouterr().err == said
