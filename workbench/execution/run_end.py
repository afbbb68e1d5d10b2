"""The end of a run that has no plan left."""

from __future__ import annotations

from workbench.execution.events import RunStatus
from workbench.planning.plans import PlanStatus
from workbench.planning.strategy import Decision

GOAL_MET = "the goal is met"


def end_without_plan(made: Decision, *, nothing_left: bool) -> tuple[RunStatus, str]:
    """The status and the reason of the end of a run whose strategy has made no plan.

    Args:
        nothing_left: whether every container is searched.
    """
    plan = made.plan
    if plan.status is PlanStatus.TIMED_OUT:
        return RunStatus.OUT_OF_BUDGET, plan.note or "no plan was found within the planning budget"
    if plan.status is PlanStatus.SOLVER_FAILED:
        return RunStatus.PLANNER_FAILED, plan.note or "the solver failed"
    if nothing_left:
        return RunStatus.MIN_REMAINING_PROBABILITY, plan.note or "every container is searched and the goal is not met"
    return RunStatus.NO_PLAN, plan.note or "no sequence of actions meets the goal"
