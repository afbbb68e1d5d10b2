"""A plan made again at a moment of a log: the typed problem, its PDDL and SAS+, and a solver's plan."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from replayers.batch.recorded_strategy import loadable_name
from replayers.runs.run import Run
from replayers.runs.state_at import decision_at, moment_of
from workbench.errors import BadValue, Unsupported
from workbench.planning.actions import prepares
from workbench.planning.builtin.plan_writer import without_hypothetical
from workbench.planning.composed import Composed, problem_at
from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.problem import Problem
from workbench.planning.rollouts.scout import Scout
from workbench.planning.solvers.location_refinement import solve_widening
from workbench.planning.solvers.pddl import PddlTask, pddl_of
from workbench.planning.solvers.protocol import BuiltIn
from workbench.planning.solvers.registry import solver_of_extra
from workbench.planning.solvers.sas import SasTask, sas_of
from workbench.planning.strategies import EVERYWHERE
from workbench.planning.strategies import strategy as strategy_named
from workbench.plugins import NameOrigin


class NoTypedProblem(Unsupported):
    """A strategy whose problem cannot be shown, because it does not plan with a typed problem."""

    def __init__(self, name: str) -> None:
        super().__init__(
            f"{name} does not plan with a typed problem, so it has no PDDL. Give another with --strategy."
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Replanned:
    """A plan made again, with the problem that it solves."""

    run: Run
    decision: int
    strategy: str
    problem: Problem
    plan: Plan
    pddl: PddlTask
    sas: SasTask
    alternatives: tuple[tuple[str, float], ...]

    def answer(self) -> dict[str, Any]:
        """For machines."""
        plan = self.plan
        return {
            "log": str(self.run.path),
            "decision": self.decision,
            "strategy": self.strategy,
            "solver": plan.solver,
            "status": str(plan.status),
            "cost": plan.cost if plan.status is PlanStatus.SOLVED else None,
            "lower_bound": plan.lower_bound,
            "optimal": plan.optimal,
            "note": plan.note,
            "places": len(self.problem.locations),
            "reachable": len(self.problem.travel.locations),
            "steps": [
                {
                    "action": s.action,
                    "origin": s.origin,
                    "target": s.target,
                    "items": list(s.items or s.item_types),
                    "cost": s.cost,
                    "does": str(s),
                }
                for s in plan.steps
            ],
            "alternatives": [{"title": title, "cost": cost} for title, cost in self.alternatives],
        }


def replan(
    run: Run,
    *,
    at: float | None = None,
    decision: int | None = None,
    strategy: str = "",
    solver: str = "",
    origin: NameOrigin = NameOrigin.LOG,
    everywhere: bool = False,
    budget_s: float = 120.0,
) -> Replanned:
    """Plans at a moment of a log.

    Args:
        at: seconds after the start; decision: by number; neither means the first.
        strategy: the run's own if not given.
        solver: the strategy's own if not given.
        origin: who gives strategy and solver. The name in the log is the log's in any case.
        everywhere: over all reachable places; so plans a strategy @everywhere in any case.

    Raises:
        BadValue: both a time and a decision.
        NoSuchDecision: the log has none there.
        UnknownRecordedStrategy: the run's own strategy is neither built in nor installed, and no other is given.
        UnknownName, NotFromLog: no such strategy or solver, or one that only a user may give.
        NoTypedProblem: a strategy that is not find cost + policy + solver.
        MissingExtra: the extra of the solver is not installed.
    """
    if at is not None and decision is not None:
        raise BadValue("moment", f"--at {at:g} and --decision {decision}", "one of the two")
    number = decision if decision is not None else decision_at(run, at or 0.0)
    moment = moment_of(run, number)
    name = strategy or loadable_name(run, other_solver=bool(solver))
    base = _base(
        _without_solver(name) if solver else name,
        origin if strategy else NameOrigin.LOG,
        cooking=prepares(moment.view.task.goal),
    )
    problem = base.problem(moment.view)
    core = problem.locations
    everywhere = everywhere or base.widens
    if everywhere:
        places = moment.view.knowledge.travel.locations
        problem = problem_at(moment.view, base.pricing, find_known=base.find_known, places=places)
    chosen = solver_of_extra(solver, origin=origin) if solver else base.solver
    if everywhere and isinstance(chosen, BuiltIn):
        widened = solve_widening(problem, core, budget_s=budget_s)
        solved = replace(widened, plan=without_hypothetical(widened.plan))
    else:
        solved = chosen.solve(problem, budget_s=budget_s)
    return Replanned(
        run=run,
        decision=number,
        strategy=name,
        problem=problem,
        plan=solved.plan,
        pddl=pddl_of(problem),
        sas=sas_of(problem),
        alternatives=tuple((other.title, other.cost) for other in solved.alternatives),
    )


def _without_solver(name: str) -> str:
    """STRATEGY of STRATEGY@SOLVER, that plans over all places still where it did."""
    base, _, solver = name.partition("@")
    return f"{base}@{EVERYWHERE}" if solver.startswith(EVERYWHERE) else base


def _base(name: str, origin: NameOrigin, *, cooking: bool) -> Composed:
    if name.partition("@")[0] == "oracle":
        raise NoTypedProblem(name)
    made = strategy_named(name, origin=origin)
    if isinstance(made, Scout):
        made = made.cooking if cooking else made.base
    if not isinstance(made, Composed):
        raise NoTypedProblem(name)
    return made
