"""Exit codes of planners: a proof, an incomplete search, limits, and plans that a limit left on disk."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_external import CASE, python_planner

from workbench.errors import Unsupported
from workbench.planning.plans import PlanStatus
from workbench.planning.solvers import external
from workbench.planning.solvers.fast_downward import FastDownward
from workbench.planning.solvers.outcomes import without_plan
from workbench.planning.solvers.pddl import pddl_of
from workbench.planning.solvers.registry import EngineRefused, installed_solver, solver_of_extra
from workbench.planning.solvers.subprocess_limits import Exit, MemoryLimit, ProgramResult, java_heap, run_program
from workbench.planning.solvers.unified_planning_child import is_proof
from workbench.plugins import NameOrigin


@pytest.mark.parametrize(
    ("code", "status", "said"),
    [
        (10, PlanStatus.NO_PLAN, "proven"),
        (11, PlanStatus.NO_PLAN, "proven"),
        (12, PlanStatus.SOLVER_FAILED, "did not prove"),
        (20, PlanStatus.SOLVER_FAILED, "out of memory"),
        (22, PlanStatus.SOLVER_FAILED, "out of memory"),
        (21, PlanStatus.TIMED_OUT, "time limit"),
        (23, PlanStatus.TIMED_OUT, "time limit"),
        (24, PlanStatus.TIMED_OUT, "time limit"),
        (0, PlanStatus.SOLVER_FAILED, "wrote no plan"),
    ],
)
def test_only_a_proof_says_that_no_plan_exists(code: int, status: PlanStatus, said: str) -> None:
    made = without_plan(ProgramResult(exit=Exit.ENDED, code=code, output="last words\n\n"), solver="x", program="it")
    assert made.status is status
    assert said in made.note


def test_a_crash_with_the_number_of_a_proof_is_a_crash() -> None:
    assert without_plan(ProgramResult(exit=Exit.CRASHED, code=-11), solver="x", program="it").status is (
        PlanStatus.SOLVER_FAILED
    )


def plan_lines(cost_first: bool) -> str:
    """A legal plan of CASE as PDDL, with or without a useless walk there and back."""
    best = FastDownward(search="blind").solve(CASE, budget_s=30).plan
    printed = pddl_of(CASE)
    by_step = {step: name for name, step in printed.steps.items() if step is not None}
    names = [next(n for s, n in by_step.items() if _same(s, step)) for step in best.steps]
    here = CASE.robot_at
    there = next(place for place in CASE.locations if place != here)
    ours = {ours: pddl for pddl, ours in printed.names.items()}
    walk = [f"move {ours[here]} {ours[there]}", f"move {ours[there]} {ours[here]}"] if not cost_first else []
    return "\n".join(f"({name})" for name in [*walk, *names, "finish-1"]) + "\n"


def _same(a: object, b: object) -> bool:
    fields = ("action", "origin", "target", "item_types")
    return all(getattr(a, name) == getattr(b, name) for name in fields)


@pytest.mark.parametrize("names", [("plan.1", "plan.2"), ("sas_plan.1", "sas_plan.2"), ("plan.txt.1", "plan.txt.2")])
def test_the_best_plan_on_disk_is_used_when_time_is_up(names: tuple[str, str], tmp_path: Path) -> None:
    end = "import time; time.sleep(60)" if names[0] == "plan.1" else "sys.exit(23)"
    good, long = plan_lines(True), plan_lines(False)
    cut = good[: len(good) // 2]
    code = (
        f"open({names[0]!r}, 'w').write({long!r})\nopen({names[1]!r}, 'w').write({good!r})\n"
        f"open({names[1] + '3'!r}, 'w').write({cut!r})\n{end}"
    )
    made = python_planner(tmp_path, code).solve(CASE, budget_s=5 if "sleep" in end else 60).plan
    assert made.status is PlanStatus.SOLVED, made.note
    assert made.cost == pytest.approx(FastDownward(search="blind").solve(CASE, budget_s=30).plan.cost)
    assert not made.optimal


def test_the_word_of_an_engine_is_a_proof_only_where_it_is_one() -> None:
    assert is_proof("symk-opt", "UNSOLVABLE_PROVEN")
    assert not is_proof("symk", "UNSOLVABLE_INCOMPLETELY")
    assert not is_proof("enhsp-opt", "UNSOLVABLE_PROVEN")


@pytest.mark.parametrize("make", [installed_solver, solver_of_extra])
def test_an_engine_without_costs_is_refused_with_the_reason(make: object, monkeypatch: pytest.MonkeyPatch) -> None:
    engines = {"fast-downward": external.EngineUse.OFFERED, "pyperplan": external.EngineUse.NO_COSTS}
    monkeypatch.setattr(external, "_engines", lambda: engines)
    external.engines_here.cache_clear()
    try:
        assert callable(make)
        with pytest.raises(EngineRefused, match=r"ignores action costs.*up-fast-downward") as refused:
            make("up-pyperplan", origin=NameOrigin.USER)
    finally:
        external.engines_here.cache_clear()
    assert isinstance(refused.value, Unsupported)


RESERVES = "import mmap; mmap.mmap(-1, 3 << 30, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS, {}); print('ran')"


@pytest.mark.parametrize(
    ("limited", "access", "runs"),
    [
        (MemoryLimit.DATA, "mmap.PROT_READ", True),
        (MemoryLimit.ADDRESS_SPACE, "mmap.PROT_READ", False),
        (MemoryLimit.DATA, "mmap.PROT_READ | mmap.PROT_WRITE", False),
    ],
)
def test_reserved_memory_is_not_charged_as_data(
    limited: MemoryLimit, access: str, runs: bool, tmp_path: Path
) -> None:
    """A Java virtual machine reserves gigabytes that it never writes to."""
    import sys

    command = [sys.executable, "-c", RESERVES.format(access)]
    answer = run_program(command, folder=tmp_path, time_s=20, memory_bytes=2 * 2**30, limited=limited)
    assert ("ran" in answer.output) is runs, answer.output


def test_the_heap_of_java_is_within_the_limit() -> None:
    assert java_heap(2 * 2**30)["JAVA_TOOL_OPTIONS"].startswith("-Xmx1433m")
