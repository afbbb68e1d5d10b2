"""The status of a planner that ended without a usable plan, from its exit code.

Exit codes as Fast Downward defines them (https://www.fast-downward.org/ExitCodes), which planners built on it share
and unified_planning_child.py uses too. Only 10 and 11 are proofs that no plan exists; 12 is the end of a search that
may have missed one. Codes 1 to 3 come with a plan, and 23 may: a plan on disk is used whatever the code.
"""

from __future__ import annotations

from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.solvers.subprocess_limits import Exit, ProgramResult

PROVEN_CODES = (10, 11)
"""Unsolvable by the translator or by the search."""
INCOMPLETE_CODES = (12,)
OUT_OF_MEMORY_CODES = (20, 22)
OUT_OF_TIME_CODES = (21, 23, 24)
"""24: time and memory ran out together."""

SHOWN = 200
"""Characters of a planner's last line that a note holds."""


def without_plan(answer: ProgramResult, *, solver: str, program: str) -> Plan:
    """The result of a program that ended without a plan.

    Args:
        solver: the solver's name; program: what it is called in the note.
    """
    status, note = _status(answer, program)
    return Plan(status=status, solver=solver, note=note)


def _status(answer: ProgramResult, program: str) -> tuple[PlanStatus, str]:
    if answer.exit is Exit.TIMED_OUT:
        return PlanStatus.TIMED_OUT, "no plan within the time limit"
    if answer.exit is Exit.ENDED:
        if answer.code in OUT_OF_TIME_CODES:
            return PlanStatus.TIMED_OUT, "no plan within the time limit"
        if answer.code in PROVEN_CODES:
            return PlanStatus.NO_PLAN, "proven: no sequence of actions meets the goal"
        if answer.code in OUT_OF_MEMORY_CODES:
            return PlanStatus.SOLVER_FAILED, f"{program} ran out of memory"
        if answer.code in INCOMPLETE_CODES:
            note = f"{program} found no plan and did not prove that none exists; it said: {_said(answer)}"
            return PlanStatus.SOLVER_FAILED, note
    note = f"{program} {answer.exit} with code {answer.code}, wrote no plan that holds, and said: {_said(answer)}"
    return PlanStatus.SOLVER_FAILED, note


def _said(answer: ProgramResult) -> str:
    return next((line for line in reversed(answer.output.splitlines()) if line.strip()), "nothing")[:SHOWN]
