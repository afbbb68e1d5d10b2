"""Solvers compared on the first decisions of task trials: status, cost over the optimum, seconds, valid plans."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, final

from workbench.evaluation.tasks.trials import PreparedTrial
from workbench.execution.events import PlanMade
from workbench.planning.builtin.solver import SolverResult
from workbench.planning.composed import Composed
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.problem import Problem
from workbench.planning.solvers.grounding import FINISH
from workbench.planning.solvers.pddl import PddlTask, pddl_of
from workbench.planning.solvers.protocol import Solver
from workbench.planning.solvers.registry import solver as solver_named
from workbench.planning.strategies import strategy as strategy_named
from workbench.plugins import NameOrigin, installed_module

STRATEGY = "model-lios"
"""Whose find costs price the problems."""
REFERENCE = "sas-lmcut"
"""The optimal solver that costs are compared with."""
PACKAGES = (
    "unified-planning", "up-fast-downward", "up-symk", "up-enhsp", "up-aries", "up-tamer", "up-pyperplan"
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class SolverRow:
    """One solver on the problems of one scenario.

    Attributes:
        statuses: how many plans had each status ("solved 4, timed-out 1").
        over_optimum: mean cost over the optimum's, of problems that both solved; None without any.
        seconds: mean wall-clock time of a plan.
        valid: of the solver's plans, how many unified-planning's validator accepts ("4 of 4"); empty without it.
        note: the first note of a plan that was not made.
    """

    scenario: str
    solver: str
    problems: int
    statuses: str
    over_optimum: float | None
    seconds: float
    valid: str
    note: str


@final
class _Kept:
    """A solver that keeps the problem it is given and makes no plan."""

    name = "kept"

    def __init__(self) -> None:
        self.problem: Problem | None = None

    def solve(self, problem: Problem, *, budget_s: float) -> SolverResult:
        self.problem = problem
        return SolverResult(plan=Plan(status=PlanStatus.SOLVER_FAILED, solver=self.name))


def first_problem(trial: PreparedTrial) -> Problem | None:
    """The typed problem of a trial's first decision; None where it is decided without one."""
    kept = _Kept()
    made = strategy_named(STRATEGY, origin=NameOrigin.LOG)
    assert isinstance(made, Composed)
    for event in trial.events(replace(made, solver=kept), "fcnn"):
        if isinstance(event, PlanMade):
            break
    return kept.problem


def compare_solvers(
    problems: dict[str, list[Problem]],
    names: Sequence[str],
    *,
    budget_s: float,
    progress: Callable[[list[tuple[str, str]]], Iterable[tuple[str, str]]] = iter,
) -> Iterator[SolverRow]:
    """A row for each scenario and solver, in order.

    Args:
        problems: by scenario.
        budget_s: the time for one plan in seconds.
        progress: wraps the pairs of scenario and solver, to show progress.
    """
    best = {
        scenario: [
            solver_named(REFERENCE, origin=NameOrigin.USER).solve(problem, budget_s=budget_s).plan for problem in some
        ]
        for scenario, some in problems.items()
    }
    for scenario, name in progress([(scenario, name) for scenario in problems for name in names]):
        made = solver_named(name, origin=NameOrigin.USER)
        yield _row(scenario, made, problems[scenario], best[scenario], budget_s)


def _row(scenario: str, made: Solver, problems: list[Problem], best: list[Plan], budget_s: float) -> SolverRow:
    plans: list[Plan] = []
    began = time.perf_counter()
    for problem in problems:
        plans.append(made.solve(problem, budget_s=budget_s).plan)
    seconds = (time.perf_counter() - began) / len(problems)
    counts = {status: sum(plan.status is status for plan in plans) for status in PlanStatus}
    solved = PlanStatus.SOLVED
    ratios = [
        plan.cost / least.cost
        for plan, least in zip(plans, best, strict=True)
        if plan.status is solved and least.status is solved and least.optimal and least.cost > 0
    ]
    judged = [
        validated(problem, plan) for problem, plan in zip(problems, plans, strict=True) if plan.status is solved
    ]
    known = [word for word in judged if word is not None]
    return SolverRow(
        scenario=scenario,
        solver=made.name,
        problems=len(problems),
        statuses=", ".join(f"{status} {count}" for status, count in counts.items() if count),
        over_optimum=round(sum(ratios) / len(ratios), 4) if ratios else None,
        seconds=round(seconds, 3),
        valid=f"{sum(known)} of {len(known)}" if known else "",
        note=next((plan.note for plan in plans if plan.status is not solved), ""),
    )


def validated(problem: Problem, plan: Plan) -> bool | None:
    """Whether unified-planning's validator accepts a plan for the printed task; None without unified-planning."""
    if installed_module("unified_planning") is None:
        return None
    printed = pddl_of(problem)
    lines = plan_lines(plan, printed)
    return lines is not None and _accepted(printed, lines)


def plan_lines(plan: Plan, printed: PddlTask) -> list[str] | None:
    """A plan's steps as ground PDDL actions, without its closing one; None for a step that the task does not have."""
    lines: list[str] = []
    for step in plan.steps:
        name = next((n for n, known in printed.steps.items() if known is not None and _is(step, known)), None)
        if name is None:
            return None
        lines.append(f"({name})")
    return lines


def _is(step: PlanStep, known: PlanStep) -> bool:
    """Whether a plan's step is a known ground step; what it handles is compared by type where no id is given."""
    same = (step.action, step.origin, step.target, step.item_types) == (
        known.action,
        known.origin,
        known.target,
        known.item_types,
    )
    return same and (not step.items or step.items == known.items)


def _accepted(printed: PddlTask, lines: list[str]) -> bool:
    from importlib import import_module

    shortcuts, io = import_module("unified_planning.shortcuts"), import_module("unified_planning.io")
    shortcuts.get_environment().credits_stream = None
    with TemporaryDirectory(prefix="lios-validate-") as folder:
        domain, task = Path(folder) / "domain.pddl", Path(folder) / "problem.pddl"
        domain.write_text(printed.domain, encoding="utf-8")
        task.write_text(printed.problem, encoding="utf-8")
        reader = io.PDDLReader()
        parsed = reader.parse_problem(str(domain), str(task))
    closing = [name for name in printed.steps if name.startswith(f"{FINISH}-")]
    with warnings.catch_warnings(), shortcuts.PlanValidator(name="sequential_plan_validator") as validator:
        warnings.simplefilter(
            "ignore"
        )  # it warns that costs over objects may be unsupported; only the plan is judged
        for last in closing:
            plan = reader.parse_plan_string(parsed, "\n".join([*lines, f"({last})"]))
            if validator.validate(parsed, plan).status.name == "VALID":
                return True
    return False


def versions() -> dict[str, Any]:
    """The installed versions of the packages that solvers come from."""
    found: dict[str, Any] = {}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
