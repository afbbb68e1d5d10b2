"""The child process that runs an engine of unified-planning on PDDL files and writes its plan (see external.py).

Usage: python -m workbench.planning.solvers.unified_planning_child ENGINE DOMAIN PROBLEM PLAN
"""

# pyright: basic, reportAttributeAccessIssue=false

from __future__ import annotations

import sys
import traceback
from pathlib import Path

SOLVED, UNSOLVABLE, NO_ANSWER, NOT_INSTALLED, RAISED = 0, 11, 12, 13, 14

NO_PROOF = ("enhsp",)
"""Engines (how their names begin) that report a proof whenever they end without a plan: ENHSP does where it could not
read the task."""


def is_proof(engine: str, status: str) -> bool:
    """Whether a status of that engine is a proof that no plan exists."""
    return status == "UNSOLVABLE_PROVEN" and not engine.startswith(NO_PROOF)


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
    except Exception as error:  # noqa: BLE001 - an engine's failure is its status
        traceback.print_exc()
        print(f"{engine} raised {type(error).__name__}: {error}")
        return RAISED
    if answer.plan is None:
        for message in answer.log_messages or ():
            print(message.message)
        print(f"{engine} found no plan, status {answer.status.name}")
        if answer.status.name == "INTERNAL_ERROR":
            return RAISED
        return UNSOLVABLE if is_proof(engine, answer.status.name) else NO_ANSWER
    lines = [
        "(" + " ".join([str(a.action.name), *(str(p) for p in a.actual_parameters)]) + ")"
        for a in answer.plan.actions
    ]
    Path(plan).write_text("\n".join(lines) + "\n", encoding="utf-8")
    return SOLVED


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:5]))
