"""The solver Fast Downward, either on SAS+ written directly or on PDDL through its translator.

Searches by name: `blind` and `lmcut` are optimal. `ff-astar2` is the paper's, as PDDLStream defines it: eager
weighted A* of weight 2 with the FF heuristic, preferred operators, and every action's cost plus one in path costs and
heuristic. `ff-astar` is plain A* with the FF heuristic, plus one in path costs alone. `anytime` returns the best plan
found in its time. None of these three is optimal.

The planner is a separate program (GPL-3.0-only) that the extra "planners" installs; it is run, never imported. The
SAS+ route has a printer of its own (sas.py) and not Fast Downward's translator, which grounds PDDL anew at every
decision in a new interpreter.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Literal, final

from workbench.errors import UnknownName
from workbench.planning.builtin.plan_writer import without_hypothetical
from workbench.planning.builtin.solver import SolverResult
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.problem import GoalReach, IllegalStep, Problem, apply, goal_reach, holds, initial_state
from workbench.planning.solvers.outcomes import without_plan
from workbench.planning.solvers.pddl import pddl_of
from workbench.planning.solvers.sas import COST_SCALE, sas_of
from workbench.planning.solvers.subprocess_limits import MEMORY_BYTES, Exit, run_program
from workbench.plugins import installed_module
from workbench.search.ties import first_of_least

SEARCHES: Mapping[str, str] = MappingProxyType(
    {
        "blind": "astar(blind())",
        "lmcut": "astar(lmcut())",
        "ff-astar": "let(h,ff(),astar(h,cost_type=plusone))",
        "ff-astar2": (
            "let(h,eval_modify_costs(ff(),cost_type=plusone),eager(alt([single(sum([g(),weight(h,2)])),"
            "single(sum([g(),weight(h,2)]),pref_only=true)]),preferred=[h],cost_type=plusone))"
        ),
        "anytime": (
            "let(h,ff(),iterated([lazy_greedy([h],preferred=[h]),lazy_wastar([h],preferred=[h],w=3),"
            "lazy_wastar([h],preferred=[h],w=1)],repeat_last=true))"
        ),
    }
)
OPTIMAL = ("blind", "lmcut")

MAX_PLAN_BYTES = 1_000_000


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class FastDownward:
    """A search of Fast Downward by one of the two routes, in a separate process.

    Raises:
        UnknownName: no such search.
    """

    search: str = "blind"
    route: Literal["sas", "pddl"] = "sas"
    memory_bytes: int = MEMORY_BYTES

    def __post_init__(self) -> None:
        if self.search not in SEARCHES:
            raise UnknownName("search of Fast Downward", self.search, SEARCHES)

    @property
    def name(self) -> str:
        return f"{self.route}-{self.search}"

    def solve(self, problem: Problem, *, budget_s: float) -> SolverResult:
        settled = trivial_plan(problem, self.name)
        if settled is not None:
            return SolverResult(plan=settled)
        home = downward_home()
        if home is None:
            note = "Fast Downward is not installed. Install it: pip install 'lios-workbench[planners]'"
            return SolverResult(plan=Plan(status=PlanStatus.SOLVER_FAILED, solver=self.name, note=note))
        with tempfile.TemporaryDirectory(prefix="lios-plan-") as folder:
            plan = self._run(problem, Path(folder), home, min(budget_s, 86_400.0))
        return SolverResult(plan=without_hypothetical(plan))

    def _run(self, problem: Problem, folder: Path, home: Path, budget_s: float) -> Plan:
        plan_file = folder / "plan"
        if self.route == "sas":
            task = sas_of(problem)
            steps = task.steps
            (folder / "task.sas").write_text(task.text, encoding="utf-8")
            binary = home / "builds" / "release" / "bin" / "downward"
            command = [str(binary), "--search", SEARCHES[self.search], "--internal-plan-file", str(plan_file)]
            stdin: Path | None = folder / "task.sas"
        else:
            printed = pddl_of(problem)
            steps = printed.steps
            (folder / "domain.pddl").write_text(printed.domain, encoding="utf-8")
            (folder / "problem.pddl").write_text(printed.problem, encoding="utf-8")
            command = [sys.executable, str(home / "fast-downward.py"), "--plan-file", str(plan_file)]
            command += ["domain.pddl", "problem.pddl", "--search", SEARCHES[self.search]]
            stdin = None
        answer = run_program(command, folder=folder, time_s=budget_s, memory_bytes=self.memory_bytes, stdin=stdin)
        best = best_plan(folder, steps, problem)
        if best is not None:
            proven = self.search in OPTIMAL and answer.exit is Exit.ENDED and answer.code == 0
            return plan_of(best, solver=self.name, optimal=proven)
        return without_plan(answer, solver=self.name, program="Fast Downward")


def trivial_plan(problem: Problem, solver: str) -> Plan | None:
    """The plan where nothing needs to be searched: the goal holds already, or its places cannot be reached."""
    if holds(problem.goal, initial_state(problem), problem):
        return Plan(status=PlanStatus.SOLVED, lower_bound=0.0, optimal=True, solver=solver)
    reach = goal_reach(problem)
    if reach.kind is GoalReach.UNREACHABLE:
        return Plan(status=PlanStatus.NO_PLAN, solver=solver, note=reach.message)
    return None


@cache
def downward_home() -> Path | None:
    """The folder of Fast Downward in the installed wheel, or None."""
    spec = installed_module("up_fast_downward")
    if spec is None or spec.origin is None:
        return None
    home = Path(spec.origin).parent / "downward"
    return home if home.is_dir() else None


def best_plan(folder: Path, steps: Mapping[str, PlanStep | None], problem: Problem) -> tuple[PlanStep, ...] | None:
    """The cheapest legal plan among a folder's files plan, plan.1, ... and sas_plan, ...; None when there is none.

    An anytime search numbers its plans, and one that is stopped may leave its last file cut off; planners built on
    Fast Downward write sas_plan unless they are given a name. Of equal ones (ties.py) the first by the file's name.
    """
    found: list[tuple[PlanStep, ...]] = []
    for path in sorted((*folder.glob("plan*"), *folder.glob("sas_plan*"))):
        if path.is_file() and path.stat().st_size <= MAX_PLAN_BYTES:
            text = path.read_text(encoding="utf-8", errors="replace")
            plan = read_plan(text, steps, problem)
            if plan is not None:
                found.append(plan)
    return first_of_least(found, lambda plan: sum(step.cost for step in plan)) if found else None


def read_plan(text: str, steps: Mapping[str, PlanStep | None], problem: Problem) -> tuple[PlanStep, ...] | None:
    """The steps of a plan file; None when it is nonsense: an unknown action, an illegal step, a goal not met."""
    state = initial_state(problem)
    plan: list[PlanStep] = []
    for line in text.splitlines():
        words = re.sub(r"^\s*\d+(\.\d+)?\s*:", "", line.split(";", 1)[0]).strip().strip("()").lower().split()
        if not words:
            continue
        name = " ".join(words)
        if name not in steps:
            return None
        step = steps[name]
        if step is None:
            continue
        try:
            state = apply(step, state)
        except IllegalStep:
            return None
        plan.append(step)
    return tuple(plan) if holds(problem.goal, state, problem) else None


def plan_of(steps: tuple[PlanStep, ...], *, solver: str, optimal: bool) -> Plan:
    cost = sum(step.cost for step in steps)
    slack = len(steps) / COST_SCALE
    """Costs were rounded to hundredths."""
    bound = max(cost - slack, 0.0) if optimal else None
    return Plan(status=PlanStatus.SOLVED, steps=steps, cost=cost, lower_bound=bound, optimal=optimal, solver=solver)
