"""The solver protocol, and the built-in solver behind it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, final

from workbench.planning.actions import prepares
from workbench.planning.builtin.plan_writer import without_hypothetical
from workbench.planning.builtin.solver import SolverResult, cost_by_first_slot, solve
from workbench.planning.problem import Problem

MAX_ITEMS_FOR_ALTERNATIVES = 6
"""Largest number of items for which alternatives are computed; beyond it, they would cost more than the plan."""


class Solver(Protocol):
    """Turns a planning problem into a plan. A crash, a hang or an invalid answer becomes a status of the plan,
    never an exception."""

    @property
    def name(self) -> str: ...

    def solve(self, problem: Problem, *, budget_s: float) -> SolverResult: ...


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class BuiltIn:
    """The built-in exact solver, run in this process.

    Attributes:
        explain: also compute the costs of alternative first steps.
    """

    explain: bool = True
    name: str = "built-in"

    def solve(self, problem: Problem, *, budget_s: float) -> SolverResult:
        made = solve(problem, budget_s=budget_s)
        others = made.alternatives
        explained = self.explain and len(made.plan.steps) > 1 and len(problem.things) <= MAX_ITEMS_FOR_ALTERNATIVES
        if explained and not prepares(problem.goal):
            others = cost_by_first_slot(problem)
        return SolverResult(plan=without_hypothetical(made.plan), alternatives=others, expanded=made.expanded)
