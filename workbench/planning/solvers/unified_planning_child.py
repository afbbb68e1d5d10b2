"""The child process that runs an engine of unified-planning on PDDL files and writes its plan (see external.py).

Usage: python -m workbench.planning.solvers.unified_planning_child ENGINE DOMAIN PROBLEM PLAN
"""

# pyright: basic, reportAttributeAccessIssue=false

from __future__ import annotations

import sys
from pathlib import Path

SOLVED, UNSOLVABLE, NOT_INSTALLED, NO_ANSWER = 0, 11, 12, 13


def main(engine: str, domain: str, problem: str, plan: str) -> int:
    from unified_planning.exceptions import (
        UPNoRequestedEngineAvailableException,
        UPNoSuitableEngineAvailableException,
    )
    from unified_planning.io import PDDLReader
    from unified_planning.shortcuts import OneshotPlanner, get_environment

    get_environment().credits_stream = None
    task = PDDLReader().parse_problem(domain, problem)
    try:
        with OneshotPlanner(name=engine) as planner:
            answer = planner.solve(task)
    except (UPNoRequestedEngineAvailableException, UPNoSuitableEngineAvailableException) as error:
        print(f"unified-planning has no engine {engine!r}: {error}")
        return NOT_INSTALLED
    if answer.plan is None:
        print(f"status {answer.status.name}")
        return UNSOLVABLE if answer.status.name.startswith("UNSOLVABLE_PROVEN") else NO_ANSWER
    lines = [
        "(" + " ".join([str(a.action.name), *(str(p) for p in a.actual_parameters)]) + ")"
        for a in answer.plan.actions
    ]
    Path(plan).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return SOLVED


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:5]))
