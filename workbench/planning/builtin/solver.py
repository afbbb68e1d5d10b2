"""The built-in solver: an exact search over every recipe, in this process, within milliseconds.

It plans over the problem's locations. Recipes are tried in order of their lower bounds; a recipe that cannot beat
the best plan so far is skipped. Tests compare its optimum with the one that Fast Downward proves for the same
problem.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from workbench.arrays import Ints
from workbench.planning.builtin.attempts import (
    Attempt,
    attempts_of,
    find_moves,
    has_state_codes,
    lower_bound,
    sequential_plan,
)
from workbench.planning.builtin.deliveries import delivery_steps
from workbench.planning.builtin.plan_writer import steps_of
from workbench.planning.builtin.search_interface import LIMIT, SOLVED
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.problem import GoalReach, Problem, goal_reach, holds, initial_state
from workbench.planning.strategy import Alternative
from workbench.search.ties import by_cost, tolerance
from workbench.tolerances import NEAR_COST

SOLVER = "built-in"
MAX_NODES = 100_000
"""Limit on expanded states over all recipes; beyond it, the plan is not proven optimal and carries a lower bound."""
MIN_NODES_PER_RECIPE = 2_000
"""States granted to every recipe even when the shared limit is used up."""
POLISH_NODES = 10_000
GREEDY, GREEDY_NODES = 3.0, 1_000_000
"""If no recipe is solved within the limit, weighted A* with this heuristic weight and node limit seeks a first
plan."""
FIRST_GREEDY_NODES, GREEDY_GROWTH = 10_000, 10
"""Node limit of the first greedy search, and its growth factor after each failure."""
MAX_BUDGET_SHARE = 0.1
"""Share of the remaining budget that one decision may spend on improving a plan; later decisions need the rest."""
QUICK_S = 0.1
"""With this much time, plain deliveries (deliveries.py) are solved without looking at the clock."""
MAX_ALTERNATIVE_NODES, MAX_FIRST_SLOT_ATTEMPTS = 5_000, 12

Clock = Callable[[], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class SolverResult:
    """A plan, with by-products of the search.

    Attributes:
        alternatives: the recipes not taken, cheapest first; where only a lower bound is known, `why_not` says so.
        expanded: number of expanded states.
    """

    plan: Plan
    alternatives: tuple[Alternative, ...] = ()
    expanded: int = 0


def solve(
    problem: Problem,
    *,
    budget_s: float = float("inf"),
    max_nodes: int = MAX_NODES,
    polish_nodes: int = POLISH_NODES,
    at_most: Plan | None = None,
    clock: Clock = time.perf_counter,
) -> SolverResult:
    """The cheapest plan over the problem's locations.

    Two passes: first, plans that carry every item straight to where it is wanted or used; then plans below that
    cost that may also put items down on the way. A pass that reaches its node limit yields a bound instead of a
    proof.

    Args:
        budget_s: time limit in seconds; afterwards the best plan so far is returned with a bound, or TIMED_OUT
            without a plan.
        max_nodes: node limit of the first pass, over all recipes.
        polish_nodes: node limit of the second pass.
        at_most: a known plan of this problem; only cheaper plans are sought.
        clock: time source in seconds, read only for the budget.
    """
    if at_most is None and budget_s >= QUICK_S and max_nodes >= MIN_NODES_PER_RECIPE:
        made = delivery_steps(problem, polish_nodes=polish_nodes)
        if made is not None:
            steps, cost, expanded = made
            return SolverResult(plan=_plan_of(steps, lower_bound=cost), expanded=expanded)
    if holds(problem.goal, initial_state(problem), problem):
        return SolverResult(plan=_plan_of((), lower_bound=0.0))
    reach = goal_reach(problem)
    if reach.kind is GoalReach.UNREACHABLE:
        return SolverResult(plan=Plan(status=PlanStatus.NO_PLAN, solver=SOLVER, note=reach.message))
    given = at_most.cost if at_most is not None and at_most.status is PlanStatus.SOLVED else float("inf")
    began = clock()
    enough = began + MAX_BUDGET_SHARE * budget_s
    run = _SearchState(problem=problem, deadline=began + budget_s, enough=enough, clock=clock, given=given)
    attempts, all_of_them = attempts_of(problem, run.is_late)
    if not all_of_them:
        run.unproven = 0.0
    run.straight(attempts, max_nodes)
    run.staging_pass(attempts, polish_nodes)
    if run.best is None and at_most is not None and at_most.status is PlanStatus.SOLVED:
        bound = min(given, run.unproven)
        kept = replace(at_most, lower_bound=bound, optimal=bound >= given - NEAR_COST, solver=SOLVER)
        return SolverResult(plan=kept, expanded=run.expanded)
    if run.best is None:
        return SolverResult(plan=_no_plan(attempts, run.unproven, late=run.is_late()), expanded=run.expanded)
    cost, attempt, moves = run.best
    plan = _plan_of(steps_of(problem, attempt, moves), lower_bound=min(cost, run.unproven))
    return SolverResult(
        plan=plan, alternatives=_alternatives(run.others, attempt.recipe.title), expanded=run.expanded
    )


@dataclass(slots=True, kw_only=True)
class _SearchState:
    """State of the two passes: the best plan so far, the smallest cost not yet excluded, and the recipes
    not taken."""

    problem: Problem
    deadline: float
    enough: float
    clock: Clock
    given: float
    best: tuple[float, Attempt, Ints] | None = None
    unproven: float = float("inf")
    expanded: int = 0
    others: list[Alternative] = field(default_factory=list[Alternative])

    def is_late(self) -> bool:
        """Whether time is up: the whole budget without a plan, MAX_BUDGET_SHARE of it with one."""
        return self.clock() > (self.deadline if self.best is None else self.enough)

    @property
    def limit(self) -> float:
        return self.best[0] if self.best is not None else self.given

    def cannot_gain(self, attempt: Attempt) -> bool:
        """Whether an attempt is known to cost no less than what is there; equal costs (ties.py) gain nothing."""
        return attempt.bound is not None and attempt.bound >= self.limit - tolerance(self.limit)

    def straight(self, attempts: list[Attempt], max_nodes: int) -> None:
        left = max_nodes
        for attempt in attempts:
            if self.cannot_gain(attempt):
                break
            if self.is_late():
                self.record_unproven(attempt)
                break
            left -= self.search_attempt(attempt, max(left, MIN_NODES_PER_RECIPE), staging=False)

    def staging_pass(self, attempts: list[Attempt], max_nodes: int) -> None:
        left = max_nodes
        for attempt in attempts:
            if self.cannot_gain(attempt):
                break
            if left <= 0 or self.is_late():
                self.record_unproven(attempt)
                break
            left -= self.search_attempt(attempt, left, staging=True)

    def search_attempt(self, attempt: Attempt, max_nodes: int, *, staging: bool) -> int:
        if not has_state_codes(attempt, staging=staging):
            self.record_unproven(attempt)
            self.sequential_plan(attempt)
            return 0
        status, cost, bound, moves, nodes = find_moves(self.problem, attempt, self.limit, max_nodes, staging=staging)
        if status == LIMIT:
            self.unproven = min(self.unproven, bound)
            self.sequential_plan(attempt)
            if self.limit == float("inf"):
                status, cost, moves, more = self.greedy_plan(attempt)
                nodes += more
        if status == SOLVED:
            self.others.append(Alternative(title=attempt.recipe.title, cost=cost, why_not="costs more"))
            self.best = (cost, attempt, moves)
        self.expanded += nodes
        return nodes

    def greedy_plan(self, attempt: Attempt) -> tuple[int, float, Ints, int]:
        """Seek a first plan by greedy search with growing node limits, until time is up."""
        most, expanded = FIRST_GREEDY_NODES, 0
        while True:
            began = self.clock()
            status, cost, _, moves, nodes = find_moves(self.problem, attempt, self.limit, most, weight=GREEDY)
            expanded += nodes
            took = self.clock() - began
            if status != LIMIT or most >= GREEDY_NODES or self.clock() + GREEDY_GROWTH * took > self.deadline:
                return status, cost, moves, expanded
            most *= GREEDY_GROWTH

    def sequential_plan(self, attempt: Attempt) -> None:
        """Use the plan that runs one errand after another, if it is the cheapest so far; it exists for any number
        of errands."""
        made = sequential_plan(self.problem, attempt)
        if made is not None and made[0] < self.limit - tolerance(self.limit):
            self.others.append(Alternative(title=attempt.recipe.title, cost=made[0], why_not="costs more"))
            self.best = (made[0], attempt, made[1])

    def record_unproven(self, attempt: Attempt) -> None:
        """Record that a plan as cheap as the attempt's lower bound is not excluded."""
        self.unproven = min(self.unproven, lower_bound(self.problem, attempt))


def cost_by_first_slot(problem: Problem) -> tuple[Alternative, ...]:
    """The cost of the cheapest plan that begins with each slot in turn; for goals with one recipe."""
    found: dict[str, float] = {}
    for attempt in attempts_of(problem)[0][:MAX_FIRST_SLOT_ATTEMPTS]:
        if attempt.hand >= 0:
            continue
        for slot in range(len(attempt.recipe.slots)):
            status, cost, _, moves, _ = find_moves(problem, attempt, float("inf"), MAX_ALTERNATIVE_NODES, first=slot)
            if status == SOLVED:
                first = next((s for s in steps_of(problem, attempt, moves) if s.action in ("find", "pick")), None)
                if first is not None:
                    verb = "find" if first.action == "find" else "fetch"
                    title = f"{verb} {first.item_types[0]} first"
                    found[title] = min(cost, found.get(title, float("inf")))
    ranked = by_cost(sorted(found.items()), lambda pair: pair[1])
    return tuple(Alternative(title=title, cost=cost) for title, cost in ranked)


def _plan_of(steps: tuple[PlanStep, ...], *, lower_bound: float) -> Plan:
    cost = sum(step.cost for step in steps)
    optimal = lower_bound >= cost - NEAR_COST
    return Plan(
        status=PlanStatus.SOLVED,
        steps=steps,
        cost=cost,
        lower_bound=min(lower_bound, cost),
        optimal=optimal,
        solver=SOLVER,
    )


def _no_plan(attempts: list[Attempt], unproven: float, *, late: bool) -> Plan:
    if unproven < float("inf"):
        within = "the planning budget" if late else "the states that the built-in solver looks at"
        return Plan(status=PlanStatus.TIMED_OUT, solver=SOLVER, note=f"no plan was found within {within}")
    missing = "no way of meeting the goal has all its things" if not attempts else "no sequence of actions meets it"
    return Plan(status=PlanStatus.NO_PLAN, solver=SOLVER, note=missing)


def _alternatives(others: list[Alternative], taken: str) -> tuple[Alternative, ...]:
    cheapest: dict[str, Alternative] = {}
    for other in others:
        if other.title != taken and (other.title not in cheapest or other.cost < cheapest[other.title].cost):
            cheapest[other.title] = other
    return tuple(by_cost([cheapest[title] for title in sorted(cheapest)], lambda other: other.cost))
