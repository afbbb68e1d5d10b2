"""Solvers that run another PDDL planner, by its command line or through unified-planning.

The planner runs in a separate process with limits on time and memory. Its plan is replayed step by step and
accepted only if every step is legal and the goal is met.
"""

from __future__ import annotations

import shlex
import shutil
import sys
import tempfile
from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import final

from workbench.errors import BadValue
from workbench.planning.builtin.plan_writer import without_hypothetical
from workbench.planning.builtin.solver import SolverResult
from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.problem import Problem
from workbench.planning.solvers.fast_downward import best_plan, plan_of, trivial_plan
from workbench.planning.solvers.pddl import PddlTask, pddl_of
from workbench.planning.solvers.subprocess_limits import MEMORY_BYTES, Answer, Exit, run_program
from workbench.plugins import installed_module

UNSOLVABLE_CODE = 11
"""What unified_planning_child.py returns for a proof that no plan exists."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class PddlCommand:
    """A planner called by a command line with {domain}, {problem} and {plan} in it.

    Raises:
        BadValue: a command line without {domain} and {problem}, or with an unclosed quotation mark.
    """

    command: str
    name: str = "pddl-command"
    memory_bytes: int = MEMORY_BYTES

    def __post_init__(self) -> None:
        if "{domain}" not in self.command or "{problem}" not in self.command:
            raise BadValue("planner's command line", self.command, "one with {domain}, {problem} and {plan} in it")
        try:
            shlex.split(self.command)
        except ValueError as error:
            raise BadValue("planner's command line", self.command, f"one that a shell can read: {error}") from error

    @property
    def program(self) -> str | None:
        """The path of the planner's executable; None if it is not installed."""
        words = shlex.split(self.command)
        return shutil.which(words[0]) if words else None

    def solve(self, problem: Problem, *, budget_s: float) -> SolverResult:
        return _solve(self.name, self.command, problem, budget_s, self.memory_bytes)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class UnifiedPlanning:
    """An engine of unified-planning, by its name there ("fast-downward", "enhsp", "tamer", ...)."""

    engine: str
    memory_bytes: int = MEMORY_BYTES

    @property
    def name(self) -> str:
        return f"up-{self.engine}"

    def solve(self, problem: Problem, *, budget_s: float) -> SolverResult:
        if installed_module("unified_planning") is None:
            note = "unified-planning is not installed. Install it: pip install 'lios-workbench[planners]'"
            return SolverResult(plan=Plan(status=PlanStatus.SOLVER_FAILED, solver=self.name, note=note))
        words = (sys.executable, "-m", "workbench.planning.solvers.unified_planning_child", self.engine)
        command = " ".join(shlex.quote(word) for word in words) + " {domain} {problem} {plan}"
        return _solve(self.name, command, problem, budget_s, self.memory_bytes)


@lru_cache(maxsize=1)
def engines_here() -> tuple[str, ...] | None:
    """The installed engines of unified-planning that produce plans, sorted; None without unified-planning."""
    if installed_module("unified_planning") is None:
        return None
    factory = import_module("unified_planning.shortcuts").get_environment().factory
    return tuple(sorted(name for name in factory.engines if factory.engine(name).is_oneshot_planner()))


def _solve(name: str, command: str, problem: Problem, budget_s: float, memory_bytes: int) -> SolverResult:
    settled = trivial_plan(problem, name)
    if settled is not None:
        return SolverResult(plan=settled)
    printed = pddl_of(problem)
    with tempfile.TemporaryDirectory(prefix="lios-plan-") as folder:
        plan = _run(name, command, printed, problem, Path(folder), min(budget_s, 86_400.0), memory_bytes)
    return SolverResult(plan=without_hypothetical(plan))


def _run(
    name: str, command: str, printed: PddlTask, problem: Problem, folder: Path, budget_s: float, memory_bytes: int
) -> Plan:
    (folder / "domain.pddl").write_text(printed.domain, encoding="utf-8")
    (folder / "problem.pddl").write_text(printed.problem, encoding="utf-8")
    names = {"domain": "domain.pddl", "problem": "problem.pddl", "plan": "plan"}
    words = [_filled(word, names) for word in shlex.split(command)]
    if not words or shutil.which(words[0]) is None:
        note = f"there is no program {words[0] if words else ''!r}. Install the planner, or give its path"
        return Plan(status=PlanStatus.SOLVER_FAILED, solver=name, note=note)
    answer = run_program(words, folder=folder, time_s=budget_s, memory_bytes=memory_bytes)
    best = best_plan(folder, printed.steps, problem)
    if best is not None:
        return plan_of(best, solver=name, optimal=False)
    return Plan(status=_status(answer), solver=name, note=_note(answer))


def _filled(word: str, names: dict[str, str]) -> str:
    for key, value in names.items():
        word = word.replace("{" + key + "}", value)
    return word


def _status(answer: Answer) -> PlanStatus:
    if answer.exit is Exit.TIMED_OUT:
        return PlanStatus.TIMED_OUT
    if answer.exit is Exit.ENDED and answer.code == UNSOLVABLE_CODE:
        return PlanStatus.NO_PLAN
    return PlanStatus.SOLVER_FAILED


def _note(answer: Answer) -> str:
    if answer.exit is Exit.TIMED_OUT:
        return "no plan within the time limit"
    said = next((line for line in reversed(answer.output.splitlines()) if line.strip()), "nothing")
    return f"the planner {answer.exit} with code {answer.code}, wrote no plan that holds, and said: {said[:200]}"
