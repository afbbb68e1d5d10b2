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
from workbench.message_enum import MessageEnum
from workbench.planning.builtin.plan_writer import without_hypothetical
from workbench.planning.builtin.solver import SolverResult
from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.problem import Problem
from workbench.planning.solvers.fast_downward import best_plan, plan_of, trivial_plan
from workbench.planning.solvers.outcomes import without_plan
from workbench.planning.solvers.pddl import PddlTask, pddl_of
from workbench.planning.solvers.subprocess_limits import MEMORY_BYTES, MemoryLimit, java_heap, run_program
from workbench.plugins import installed_module

ANY_COST = "ACTIONS_COST"
"""The feature that an engine of unified-planning must have: without it, it neither reads nor minimises costs."""


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
        return _Run(name=self.name, command=self.command, memory_bytes=self.memory_bytes).solve(problem, budget_s)


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
        run = _Run(name=self.name, command=command, memory_bytes=self.memory_bytes, limited=MemoryLimit.DATA)
        return run.solve(problem, budget_s)


@lru_cache(maxsize=1)
def engines_here() -> tuple[str, ...] | None:
    """The installed engines of unified-planning that plan with costs, sorted; None without unified-planning.

    Left out are its meta-engines, such as "oversubscription[symk]", and those that are not offered.
    """
    found = _engines()
    return None if found is None else tuple(sorted(name for name, use in found.items() if use is EngineUse.OFFERED))


def engine_use(engine: str) -> EngineUse:
    """Whether an engine of unified-planning is offered; so is one that is not installed, which is refused later."""
    return (_engines() or {}).get(engine, EngineUse.OFFERED)


@lru_cache(maxsize=1)
def _engines() -> dict[str, EngineUse] | None:
    """Each installed engine that produces plans; None without unified-planning."""
    if installed_module("unified_planning") is None:
        return None
    factory = import_module("unified_planning.shortcuts").get_environment().factory
    found: dict[str, EngineUse] = {}
    for name in factory.engines:
        engine = factory.engine(name)
        if engine.is_oneshot_planner() and "[" not in name:
            costs = ANY_COST in engine.supported_kind().features
            found[name] = REFUSED.get(name, EngineUse.OFFERED) if costs else EngineUse.NO_COSTS
    return found


class EngineUse(MessageEnum):
    """Whether an engine of unified-planning is offered as a solver, and if not, why."""

    OFFERED = ""
    NO_COSTS = "it ignores action costs, so its plans would be cheap only by chance"
    NO_REAL_COSTS = "it supports only integers, and unified-planning reads PDDL costs as reals"


REFUSED = {"aries": EngineUse.NO_REAL_COSTS}
"""Engines that say that they plan with costs, and do not with ours."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Run:
    """A planner's command line with its limits."""

    name: str
    command: str
    memory_bytes: int
    limited: MemoryLimit = MemoryLimit.DATA

    def solve(self, problem: Problem, budget_s: float) -> SolverResult:
        settled = trivial_plan(problem, self.name)
        if settled is not None:
            return SolverResult(plan=settled)
        printed = pddl_of(problem)
        with tempfile.TemporaryDirectory(prefix="lios-plan-") as folder:
            plan = self._run(printed, problem, Path(folder), min(budget_s, 86_400.0))
        return SolverResult(plan=without_hypothetical(plan))

    def _run(self, printed: PddlTask, problem: Problem, folder: Path, budget_s: float) -> Plan:
        (folder / "domain.pddl").write_text(printed.domain, encoding="utf-8")
        (folder / "problem.pddl").write_text(printed.problem, encoding="utf-8")
        names = {"domain": "domain.pddl", "problem": "problem.pddl", "plan": "plan"}
        words = [_filled(word, names) for word in shlex.split(self.command)]
        if not words or shutil.which(words[0]) is None:
            note = f"there is no program {words[0] if words else ''!r}. Install the planner, or give its path"
            return Plan(status=PlanStatus.SOLVER_FAILED, solver=self.name, note=note)
        answer = run_program(
            words,
            folder=folder,
            time_s=budget_s,
            memory_bytes=self.memory_bytes,
            environment=java_heap(self.memory_bytes),
            limited=self.limited,
        )
        best = best_plan(folder, printed.steps, problem)
        if best is not None:
            return plan_of(best, solver=self.name, optimal=False)
        return without_plan(answer, solver=self.name, program="the planner")


def _filled(word: str, names: dict[str, str]) -> str:
    for key, value in names.items():
        word = word.replace("{" + key + "}", value)
    return word
