"""Planning over a growing set of locations, until the plan is proven optimal or time is up.

For cooking, a meeting place outside the core locations may be better. So the plan over the core bounds a search
over the core and its nearest other locations, and that one bounds a search over all of them. Cheaper plans are
found, and the lower bound of the last search gives the optimality gap.
"""

from __future__ import annotations

import time
from dataclasses import replace

from workbench.planning.builtin.solver import Clock, SolverResult, solve
from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.problem import Problem
from workbench.search.ties import by_cost
from workbench.tolerances import TINY
from workbench.worlds.house import LocationId

STAGES = (6, 16)
"""Number of further locations in each stage before the last."""

NODES = 400_000


def solve_widening(
    problem: Problem, core: tuple[LocationId, ...], *, budget_s: float, clock: Clock = time.perf_counter
) -> SolverResult:
    """The cheapest plan found over all locations of the problem, with its proven gap.

    Args:
        problem: problem over all locations, with find costs for all of them.
        core: the most relevant locations of the problem; planned over first.
    """
    deadline = clock() + budget_s
    others = by_cost(
        sorted(p for p in problem.locations if p not in core), lambda p: _detour_from_core(problem, core, p)
    )
    made = solve(replace(problem, locations=core), budget_s=budget_s, clock=clock)
    for more in (*STAGES, len(others)):
        left = deadline - clock()
        if left <= 0 or more == 0:
            break
        places = (*core, *others[:more])
        known = made.plan if made.plan.status is PlanStatus.SOLVED else None
        wider = solve(
            replace(problem, locations=places),
            budget_s=left,
            max_nodes=NODES,
            polish_nodes=NODES,
            at_most=known,
            clock=clock,
        )
        made = replace(wider, alternatives=wider.alternatives or made.alternatives)
        if more >= len(others):
            return replace(made, plan=_with_gap(made.plan, len(problem.locations)))
    if not others:
        return replace(made, plan=_with_gap(made.plan, len(problem.locations)))
    return replace(made, plan=replace(made.plan, optimal=False, lower_bound=None, note="not all places were tried"))


def _with_gap(plan: Plan, places: int) -> Plan:
    """The plan with its proven gap in its note."""
    if plan.status is not PlanStatus.SOLVED or plan.lower_bound is None:
        return plan
    gap = 0.0 if plan.optimal else 1.0 - plan.lower_bound / max(plan.cost, TINY)
    proven = "optimal" if plan.optimal else f"at most {100 * gap:.1f} % above the best"
    return replace(plan, note=f"{proven} over all {places} places")


def _detour_from_core(problem: Problem, core: tuple[LocationId, ...], place: LocationId) -> float:
    """The distance of a location from the core: the sum of its two least distances to core locations."""
    return sum(sorted(problem.distance(place, other) for other in core)[:2])
