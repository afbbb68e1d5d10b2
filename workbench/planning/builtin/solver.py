"""The built-in solver: an exact search over every recipe, in this process, within milliseconds.

It plans over the problem's locations. Recipes are tried in order of their lower bounds; a recipe that cannot beat
the best plan so far is skipped. Tests compare its optimum with the one that Fast Downward proves for the same
problem.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from workbench.planning.builtin.greedy_order import errand_order
from workbench.planning.builtin.move_codes import CARRY, CHOOSE, FETCH, LIMIT, PLACE, SOLVED, FloatArray, IntArray
from workbench.planning.builtin.recipes import MAX_RECIPES, Operation, Recipe, recipes_of
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.problem import MISSING, Problem, Thing, holds, initial_state, unreachable_goal
from workbench.planning.strategy import Alternative
from workbench.search.ties import by_cost, first_of_least, tolerance
from workbench.tolerances import NEAR_COST
from workbench.worlds.house import LocationId

if TYPE_CHECKING:
    from workbench.planning.builtin.find_routes import FindRoutes

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
MAX_ALTERNATIVE_NODES = 5_000
MAX_POTENTIALS = 3
"""Number of places whose distances serve as potentials of the heuristic."""
MAX_STATE_CODE = 2**62

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


@dataclass(slots=True)
class _Attempt:
    """One recipe with one way of beginning: using the held item, or putting it down first.

    Attributes:
        bound: lower bound on its cost; None until computed.
    """

    recipe: Recipe
    arrays: _Arrays
    hand: int
    put_down: bool
    bound: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Arrays:
    """A recipe in numbers; see recipe_search.search for shapes. Finds go by `routes`."""

    d: FloatArray
    routes: FindRoutes
    fetch: FloatArray
    least: FloatArray
    potential: FloatArray
    standing: IntArray
    end: IntArray
    in_hand: IntArray
    op_slot: IntArray
    op_where: IntArray
    op_after: IntArray
    link: IntArray
    n_ops: int


def solve(
    problem: Problem,
    *,
    budget_s: float = float("inf"),
    most_nodes: int = MAX_NODES,
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
        most_nodes: node limit of the first pass, over all recipes.
        polish_nodes: node limit of the second pass.
        at_most: a known plan of this problem; only cheaper plans are sought.
        clock: time source in seconds, read only for the budget.
    """
    if holds(problem.goal, initial_state(problem), problem):
        return SolverResult(plan=_plan_of((), lower_bound=0.0))
    unreachable = unreachable_goal(problem)
    if unreachable:
        return SolverResult(plan=Plan(status=PlanStatus.NO_PLAN, solver=SOLVER, note=unreachable))
    given = at_most.cost if at_most is not None and at_most.status is PlanStatus.SOLVED else float("inf")
    began = clock()
    enough = began + MAX_BUDGET_SHARE * budget_s
    run = _SearchState(problem=problem, deadline=began + budget_s, enough=enough, clock=clock, given=given)
    attempts, all_of_them = _attempts(problem, run.is_late)
    if not all_of_them:
        run.unproven = 0.0
    run.straight(attempts, most_nodes)
    run.staging_pass(attempts, polish_nodes)
    if run.best is None and at_most is not None and at_most.status is PlanStatus.SOLVED:
        bound = min(given, run.unproven)
        kept = replace(at_most, lower_bound=bound, optimal=bound >= given - NEAR_COST, solver=SOLVER)
        return SolverResult(plan=kept, expanded=run.expanded)
    if run.best is None:
        return SolverResult(plan=_no_plan(attempts, run.unproven, late=run.is_late()), expanded=run.expanded)
    cost, attempt, moves = run.best
    plan = _plan_of(_steps(problem, attempt, moves), lower_bound=min(cost, run.unproven))
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
    best: tuple[float, _Attempt, IntArray] | None = None
    unproven: float = float("inf")
    expanded: int = 0
    others: list[Alternative] = field(default_factory=list[Alternative])

    def is_late(self) -> bool:
        """Whether time is up: the whole budget without a plan, MAX_BUDGET_SHARE of it with one."""
        return self.clock() > (self.deadline if self.best is None else self.enough)

    @property
    def limit(self) -> float:
        return self.best[0] if self.best is not None else self.given

    def cannot_gain(self, attempt: _Attempt) -> bool:
        """Whether an attempt is known to cost no less than what is there; equal costs (ties.py) gain nothing."""
        return attempt.bound is not None and attempt.bound >= self.limit - tolerance(self.limit)

    def straight(self, attempts: list[_Attempt], most_nodes: int) -> None:
        left = most_nodes
        for attempt in attempts:
            if self.cannot_gain(attempt):
                break
            if self.is_late():
                self.record_unproven(attempt)
                break
            left -= self.search_attempt(attempt, max(left, MIN_NODES_PER_RECIPE), staging=False)

    def staging_pass(self, attempts: list[_Attempt], most_nodes: int) -> None:
        left = most_nodes
        for attempt in attempts:
            if self.cannot_gain(attempt):
                break
            if left <= 0 or self.is_late():
                self.record_unproven(attempt)
                break
            left -= self.search_attempt(attempt, left, staging=True)

    def search_attempt(self, attempt: _Attempt, most_nodes: int, *, staging: bool) -> int:
        if not has_state_codes(attempt, staging=staging):
            self.record_unproven(attempt)
            self.sequential_plan(attempt)
            return 0
        status, cost, bound, moves, nodes = _search(self.problem, attempt, self.limit, most_nodes, staging=staging)
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

    def greedy_plan(self, attempt: _Attempt) -> tuple[int, float, IntArray, int]:
        """Seek a first plan by greedy search with growing node limits, until time is up."""
        most, expanded = FIRST_GREEDY_NODES, 0
        while True:
            began = self.clock()
            status, cost, _, moves, nodes = _search(self.problem, attempt, self.limit, most, weight=GREEDY)
            expanded += nodes
            took = self.clock() - began
            if status != LIMIT or most >= GREEDY_NODES or self.clock() + GREEDY_GROWTH * took > self.deadline:
                return status, cost, moves, expanded
            most *= GREEDY_GROWTH

    def sequential_plan(self, attempt: _Attempt) -> None:
        """Use the plan that runs one errand after another, if it is the cheapest so far; it exists for any number
        of errands."""
        made = _sequential_plan(self.problem, attempt)
        if made is not None and made[0] < self.limit - tolerance(self.limit):
            self.others.append(Alternative(title=attempt.recipe.title, cost=made[0], why_not="costs more"))
            self.best = (made[0], attempt, made[1])

    def record_unproven(self, attempt: _Attempt) -> None:
        """Record that a plan as cheap as the attempt's lower bound is not excluded."""
        self.unproven = min(self.unproven, _lower_bound(self.problem, attempt))


def has_state_codes(attempt: _Attempt, *, staging: bool) -> bool:
    """Whether the states of the search fit into 62-bit codes."""
    n, slots = len(attempt.arrays.d), len(attempt.recipe.slots)
    if (n * (slots + 1) << attempt.arrays.n_ops) * (n + 1) ** slots < MAX_STATE_CODE:
        return True
    used = {slot for operation in attempt.recipe.operations for slot in operation.slots}
    states = n * (slots + 1) << attempt.arrays.n_ops
    for slot in range(slots):
        states *= n + 1 if staging or slot in used else 2
    return states < MAX_STATE_CODE


def _sequential_plan(problem: Problem, attempt: _Attempt) -> tuple[float, IntArray] | None:
    """Cost and moves (in reverse order) of fetching one item after another; None for recipes with preparations, or
    if infeasible."""
    a, hand = attempt.arrays, attempt.hand
    if a.n_ops or (hand >= 0 and a.in_hand[hand]):
        return None
    robot, c = problem.locations.index(problem.robot_at), problem.costs.manipulation
    cost, moves = (c if attempt.put_down else 0.0), list[tuple[int, int, int]]()
    if hand >= 0:
        cost += float(a.d[robot, a.end[hand]]) + c
        robot = int(a.end[hand])
        moves += [(CARRY, hand, robot), (PLACE, hand, robot)]
    stands = [not a.in_hand[s] and a.standing[s, end] for s, end in enumerate(a.end)]
    carried = [s for s in range(len(a.end)) if s != hand and not stands[s] and not a.in_hand[s]]
    ends = a.end[carried].astype(np.int64)
    leg = a.fetch[np.array(carried, dtype=np.int64)[None, :], np.array([robot, *ends])[:, None], ends[None, :]] + c
    spent, order = errand_order(leg)
    cost += spent
    for i in order:
        robot = int(ends[i])
        moves += [(FETCH, carried[i], robot), (PLACE, carried[i], robot)]
    for s in (s for s in range(len(a.end)) if a.in_hand[s]):
        cost += float(a.fetch[s, robot, a.end[s]])
        moves.append((FETCH, s, int(a.end[s])))
    if not np.isfinite(cost):
        return None
    return cost, np.array(moves[::-1], dtype=np.int64).reshape(-1, 3)


def cost_by_first_slot(problem: Problem, *, most: int = 12) -> tuple[Alternative, ...]:
    """The cost of the cheapest plan that begins with each slot in turn; for goals with one recipe."""
    found: dict[str, float] = {}
    for attempt in _attempts(problem)[0][:most]:
        if attempt.hand >= 0:
            continue
        for slot in range(len(attempt.recipe.slots)):
            status, cost, _, moves, _ = _search(problem, attempt, float("inf"), MAX_ALTERNATIVE_NODES, first=slot)
            if status == SOLVED:
                first = next((s for s in _steps(problem, attempt, moves) if s.action in ("find", "pick")), None)
                if first is not None:
                    verb = "find" if first.action == "find" else "fetch"
                    title = f"{verb} {first.item_types[0]} first"
                    found[title] = min(cost, found.get(title, float("inf")))
    ranked = by_cost(sorted(found.items()), lambda pair: pair[1])
    return tuple(Alternative(title=title, cost=cost) for title, cost in ranked)


def _attempts(problem: Problem, is_late: Callable[[], bool] = lambda: False) -> tuple[list[_Attempt], bool]:
    """Every recipe with every way to begin, sorted by lower bound (stable), and whether the list is complete."""
    held = next((thing for thing in problem.things if thing.held), None)
    attempts: list[_Attempt] = []
    recipes, routes = recipes_of(problem), _routes(problem)
    complete = len(recipes) < MAX_RECIPES
    for recipe in recipes:
        if attempts and is_late():
            complete = False
            break
        arrays = _arrays(problem, recipe, routes)
        if held is None:
            attempts.append(_Attempt(recipe, arrays, -1, False))
        else:
            attempts.append(_Attempt(recipe, arrays, -1, True))
            holding = [slot for slot, wanted in enumerate(recipe.slots) if held.id in wanted.things]
            attempts += [_Attempt(recipe, arrays, slot, False) for slot in holding]
        if len(attempts) > 1:  # a single attempt needs no bound
            _lower_bound(problem, attempts[-1])
    if len(attempts) > 1:
        attempts = by_cost(attempts, lambda attempt: _lower_bound(problem, attempt))
    return attempts, complete


def _lower_bound(problem: Problem, attempt: _Attempt) -> float:
    """The lower bound on an attempt's cost; cached in the attempt."""
    if attempt.bound is None:
        attempt.bound = _search(problem, attempt, 0.0, 1)[2]
    return attempt.bound


def _search(
    problem: Problem,
    attempt: _Attempt,
    bound: float,
    most_nodes: int,
    *,
    first: int = -1,
    staging: bool = False,
    weight: float = 1.0,
) -> tuple[int, float, float, IntArray, int]:
    from workbench.planning.builtin.astar import search

    a = attempt.arrays
    c = problem.costs.manipulation
    robot = problem.locations.index(problem.robot_at)
    return search(
        robot, attempt.hand, c if attempt.put_down else 0.0, first, a.d, a.fetch, a.least, a.potential, a.standing,
        a.end, a.in_hand, a.op_slot, a.op_where, a.op_after, a.link, a.n_ops, c, staging, weight, bound, most_nodes,
    )  # fmt: skip


def _arrays(problem: Problem, recipe: Recipe, routes: FindRoutes) -> _Arrays:
    where = {location: i for i, location in enumerate(problem.locations)}
    rows = problem.travel.rows(problem.locations)
    d = problem.travel.metres[rows[:, None], rows]
    op_slot, op_where, op_after, link = _operations(recipe) if recipe.operations else EMPTY_OPERATIONS
    centres = sorted({where[slot.end] for slot in recipe.slots if slot.end})[:MAX_POTENTIALS]
    potential = np.zeros((1 + len(centres), len(rows)))
    potential[1:] = d[:, centres].T
    fetch, least, standing = _errands(problem, recipe, routes, where, d, potential)
    return _Arrays(
        d=d,
        routes=routes,
        fetch=fetch,
        least=least,
        potential=potential,
        standing=standing,
        end=np.array([where[slot.end] if slot.end else -1 for slot in recipe.slots], dtype=np.int64),
        in_hand=np.array([slot.in_hand for slot in recipe.slots], dtype=np.int64),
        op_slot=op_slot,
        op_where=op_where,
        op_after=op_after,
        link=link,
        n_ops=len(recipe.operations),
    )


def _routes(problem: Problem) -> FindRoutes:
    """How a missing thing of each type is got from each of the problem's locations to each."""
    from workbench.planning.builtin.find_routes import find_routes

    rows = problem.travel.rows(problem.locations)
    return find_routes(_find_tables(problem), problem.travel.metres[rows[:, None], rows])


def _errands(
    problem: Problem,
    recipe: Recipe,
    routes: FindRoutes,
    where: dict[LocationId, int],
    d: FloatArray,
    potential: FloatArray,
) -> tuple[FloatArray, FloatArray, IntArray]:
    """fetch, least and standing of recipe_search.search."""
    from workbench.planning.builtin.astar import errand_costs

    things = {thing.id: thing for thing in problem.things}
    at = np.full((len(recipe.slots), max((len(slot.things) for slot in recipe.slots), default=0)), -1)
    find = np.full_like(at, -1)
    for s, slot in enumerate(recipe.slots):
        for j, name in enumerate(slot.things):
            place = _place_of(problem, things[name])
            if place is not None:
                at[s, j] = where[place]
            elif problem.find_costs is not None:
                find[s, j] = problem.find_costs.item_types.index(things[name].type)
    return errand_costs(at, find, routes.metres, d, potential, problem.costs.manipulation)


def _find_tables(problem: Problem) -> FloatArray:
    """Find costs between the problem's locations, shape (types, locations, locations), read-only."""
    costs, n = problem.find_costs, len(problem.locations)
    if costs is not None and costs.origins == problem.locations == costs.targets:
        return costs.metres
    tables = np.zeros((0, n, n))
    if costs is not None:
        rows = [costs.origins.index(location) for location in problem.locations]
        columns = [costs.targets.index(location) for location in problem.locations]
        tables = np.ascontiguousarray(costs.metres[:, np.array(rows)[:, None], columns])
    tables.flags.writeable = False
    return tables


def _operations(recipe: Recipe) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """op_slot, op_where, op_after and link of recipe_search.search."""
    parts = max([len(o.slots) for o in recipe.operations], default=1)
    op_slot = np.full((max(len(recipe.operations), 1), parts), -1, dtype=np.int64)
    op_where = np.zeros_like(op_slot)
    op_after = np.zeros(len(op_slot), dtype=np.int64)
    for o, operation in enumerate(recipe.operations):
        op_after[o] = sum(1 << before for before in operation.after)
        for j, slot in enumerate(operation.slots):
            op_slot[o, j] = slot
            op_where[o, j] = operation.preparation.parts[j].where == "hand"
    return op_slot, op_where, op_after, _links(recipe)


def _links(recipe: Recipe) -> IntArray:
    """Pairs of consecutive operations that share a standing slot; see recipe_search.search."""
    operations = recipe.operations
    link = np.full((max(len(operations), 1), 4), -1, dtype=np.int64)
    link[:, 3] = 0
    for o, operation in enumerate(operations):
        for before in operation.after:
            if link[o, 0] < 0 and link[before, 1] < 0:
                shared = sorted(set(_standing_slots(operation)) & set(_standing_slots(operations[before])))
                if shared:
                    link[o, 0], link[before, 1], link[before, 2] = before, o, shared[0]
            free = len(_standing_slots(operation)) == len(operation.slots)
            tools = set(operations[before].slots) - set(_standing_slots(operations[before]))
            if free and any(recipe.slots[tool].end is None for tool in tools):
                link[before, 3] = 1
    return link


def _standing_slots(operation: Operation) -> tuple[int, ...]:
    parts = zip(operation.slots, operation.preparation.parts, strict=True)
    return tuple(slot for slot, part in parts if part.where == "here")


EMPTY_OPERATIONS = _operations(Recipe())
"""Operation arrays of recipes without preparations."""


def _place_of(problem: Problem, thing: Thing) -> LocationId | None:
    """Where an item stands once the hand is free; None if it is missing."""
    return problem.robot_at if thing.held else thing.at


def _fetch_cost(problem: Problem, thing: Thing, arrays: _Arrays, i: int, j: int) -> float:
    """One entry of a thing's own table of errands, by the numbers of two locations."""
    at, costs = _place_of(problem, thing), problem.find_costs
    if at is None:
        return float(arrays.routes.metres[costs.item_types.index(thing.type), i, j]) if costs else float("inf")
    k = problem.locations.index(at)
    return float(arrays.d[i, k] + problem.costs.manipulation + arrays.d[k, j])


def _steps(problem: Problem, attempt: _Attempt, moves: IntArray) -> tuple[PlanStep, ...]:
    """The errands found by the search (in reverse order) as steps of a plan."""
    return _PlanWriter(problem, attempt).steps(moves)


class _PlanWriter:
    """Expands errands into plan steps while tracking the state."""

    def __init__(self, problem: Problem, attempt: _Attempt) -> None:
        self.problem, self.attempt = problem, attempt
        self.things = {thing.id: thing for thing in problem.things}
        self.robot = problem.robot_at
        self.chosen: dict[int, Thing] = {}
        self.at: dict[int, LocationId] = {}
        self.out: list[PlanStep] = []

    def steps(self, moves: IntArray) -> tuple[PlanStep, ...]:
        held = next((thing for thing in self.problem.things if thing.held), None)
        if held is not None and self.attempt.put_down:
            self.handle("place", held)
        if held is not None and self.attempt.hand >= 0:
            self.chosen[self.attempt.hand] = held
        for kind, x, b in moves[::-1].tolist():
            self.follow(kind, x, self.problem.locations[b])
        return tuple(self.out)

    def follow(self, kind: int, x: int, b: LocationId) -> None:
        if kind == CHOOSE:
            fitting = [t for t in self.fitting(x) if _place_of(self.problem, t) == b]
            self.chosen[x], self.at[x] = fitting[0], b
        elif kind == FETCH:
            self.fetch(x, b)
        elif kind == CARRY:
            self.walk(b)
        elif kind == PLACE:
            self.handle("place", self.chosen[x])
            self.at[x] = self.robot
        else:
            self.prepare(x, b)

    def fitting(self, slot: int) -> list[Thing]:
        return [self.things[name] for name in self.attempt.recipe.slots[slot].things]

    def fetch(self, slot: int, b: LocationId) -> None:
        d = self.problem
        if slot not in self.chosen:
            i, j = d.locations.index(self.robot), d.locations.index(b)
            fitting = sorted(self.fitting(slot), key=lambda t: t.id)
            thing = first_of_least(fitting, lambda t: _fetch_cost(d, t, self.attempt.arrays, i, j))
            self.chosen[slot] = thing
            if thing.missing:
                self.find(thing, i, j)
                return
            self.at[slot] = self.problem.robot_at if thing.at is None else thing.at
        self.walk(self.at[slot])
        self.handle("pick", self.chosen[slot])
        self.walk(b)

    def find(self, thing: Thing, i: int, j: int) -> None:
        """The find, and the walks before and after it, between two locations by their numbers."""
        locations, costs, routes = self.problem.locations, self.problem.find_costs, self.attempt.arrays.routes
        assert costs is not None, "what is missing is offered with its find costs"
        item = costs.item_types.index(thing.type)
        begin, end = locations[routes.begin[item, i, j]], locations[routes.end[item, i, j]]
        self.walk(begin)
        self.step("find", end, thing, costs.of(thing.type, begin, end))
        self.walk(locations[j])

    def prepare(self, number: int, b: LocationId) -> None:
        self.walk(b)
        operation = self.attempt.recipe.operations[number]
        things = [self.chosen[slot] for slot in operation.slots]
        self.out.append(
            PlanStep(
                action=operation.preparation.name,
                origin=self.robot,
                target=self.robot,
                item_types=tuple(thing.type for thing in things),
                items=tuple(thing.id for thing in things),
                cost=self.problem.costs.manipulation,
            )
        )

    def handle(self, action: str, thing: Thing) -> None:
        self.step(action, self.robot, thing, self.problem.costs.manipulation)

    def walk(self, b: LocationId) -> None:
        if b != self.robot:
            self.step("move", b, None, self.problem.distance(self.robot, b))

    def step(self, action: str, target: LocationId, thing: Thing | None, cost: float) -> None:
        self.out.append(
            PlanStep(
                action=action,
                origin=self.robot,
                target=target,
                item_types=(thing.type,) if thing else (),
                items=(thing.id,) if thing else (),
                cost=cost,
            )
        )
        self.robot = target


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


def _no_plan(attempts: list[_Attempt], unproven: float, *, late: bool) -> Plan:
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


def without_hypothetical(plan: Plan) -> Plan:
    """The plan without ids of hypothetical items: an item not found yet has a type only."""
    unknown = [any(item.startswith(MISSING) for item in step.items) for step in plan.steps]
    if not any(unknown):
        return plan
    pairs = zip(plan.steps, unknown, strict=True)
    return replace(plan, steps=tuple([_without_items(step) if hidden else step for step, hidden in pairs]))


def _without_items(step: PlanStep) -> PlanStep:
    return PlanStep(
        action=step.action, origin=step.origin, target=step.target, item_types=step.item_types, cost=step.cost
    )
