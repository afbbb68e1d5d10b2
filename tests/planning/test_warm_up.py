"""Everything that a first decision needs is compiled before time is measured."""

from __future__ import annotations

from itertools import count
from typing import Any

import pytest
from toy import toy_plan, toy_travel

from workbench.planning import warm_up as warm_ups
from workbench.planning.builtin.solver import SolverResult, solve
from workbench.planning.problem import Problem
from workbench.planning.rollouts import choice
from workbench.planning.solvers import protocol
from workbench.worlds.knowledge import knowledge_at_start


def test_rollouts_are_compiled_too_however_long_the_solver_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """The planning budget of a warm-up outlasts compiling: the solver, by a clock that jumps ten seconds at a look,
    still has time, and the rollouts are reached."""
    reached: list[bool] = []
    ticks = count(step=10)
    best_first_step = choice.best_first_step

    def slowly(problem: Problem, budget_s: float, **more: Any) -> SolverResult:
        return solve(problem, budget_s=budget_s, clock=lambda: float(next(ticks)), **more)

    def watched(*arrays: Any) -> Any:
        reached.append(True)
        return best_first_step(*arrays)

    monkeypatch.setattr(protocol, "solve", slowly)
    monkeypatch.setattr(choice, "best_first_step", watched)
    warm_ups._plan_once(knowledge_at_start(toy_plan(), toy_travel(), {}))
    assert reached
