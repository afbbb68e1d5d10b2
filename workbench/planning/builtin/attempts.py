"""Attempts of the built-in solver: each recipe with each way of beginning, its lower bound, and its search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from workbench.arrays import Ints
from workbench.planning.builtin.greedy_order import errand_order
from workbench.planning.builtin.recipe_arrays import arrays_of, routes_of
from workbench.planning.builtin.recipes import MAX_RECIPES, Recipe, recipes_of
from workbench.planning.builtin.search_interface import CARRY, FETCH, PLACE, RecipeArrays, RecipeQuery
from workbench.planning.problem import Problem
from workbench.search.ties import by_cost

if TYPE_CHECKING:
    from workbench.planning.builtin.find_routes import FindRoutes

MAX_STATE_CODE = 2**62


@dataclass(slots=True)
class Attempt:
    """One recipe with one way of beginning: using the held item, or putting it down first.

    Attributes:
        routes: how a missing thing of each type is got.
        hand: the slot that the held item fills, or -1.
        bound: lower bound on its cost; None until computed.
    """

    recipe: Recipe
    arrays: RecipeArrays
    routes: FindRoutes
    hand: int
    put_down: bool
    bound: float | None = None


def attempts_of(problem: Problem, is_late: Callable[[], bool] = lambda: False) -> tuple[list[Attempt], bool]:
    """Every recipe with every way to begin, sorted by lower bound (stable), and whether the list is complete."""
    held = next((thing for thing in problem.things if thing.held), None)
    attempts: list[Attempt] = []
    recipes, routes = recipes_of(problem), routes_of(problem)
    complete = len(recipes) < MAX_RECIPES
    for recipe in recipes:
        if attempts and is_late():
            complete = False
            break
        arrays = arrays_of(problem, recipe, routes)
        if held is None:
            attempts.append(Attempt(recipe, arrays, routes, -1, False))
        else:
            attempts.append(Attempt(recipe, arrays, routes, -1, True))
            holding = [slot for slot, wanted in enumerate(recipe.slots) if held.id in wanted.things]
            attempts += [Attempt(recipe, arrays, routes, slot, False) for slot in holding]
        if len(attempts) > 1:  # a single attempt needs no bound
            lower_bound(problem, attempts[-1])
    if len(attempts) > 1:
        attempts = by_cost(attempts, lambda attempt: lower_bound(problem, attempt))
    return attempts, complete


def lower_bound(problem: Problem, attempt: Attempt) -> float:
    """The lower bound on an attempt's cost; cached in the attempt."""
    if attempt.bound is None:
        attempt.bound = find_moves(problem, attempt, 0.0, 1)[2]
    return attempt.bound


def find_moves(
    problem: Problem,
    attempt: Attempt,
    bound: float,
    max_nodes: int,
    *,
    first: int = -1,
    staging: bool = False,
    weight: float = 1.0,
) -> tuple[int, float, float, Ints, int]:
    from workbench.planning.builtin.astar import search

    query = RecipeQuery(
        robot=problem.locations.index(problem.robot_at),
        hand=attempt.hand,
        spent=float(problem.costs.manipulation) if attempt.put_down else 0.0,
        bound=bound,
        max_nodes=max_nodes,
        first=first,
        staging=staging,
        weight=weight,
    )
    return search(attempt.arrays, query)


def has_state_codes(attempt: Attempt, *, staging: bool) -> bool:
    """Whether the states of the search fit into 62-bit codes."""
    n, slots = len(attempt.arrays.d), len(attempt.recipe.slots)
    if has_codes_of_all(n, slots, attempt.arrays.n_ops):
        return True
    used = {slot for operation in attempt.recipe.operations for slot in operation.slots}
    states = n * (slots + 1) << attempt.arrays.n_ops
    for slot in range(slots):
        states *= n + 1 if staging or slot in used else 2
    return states < MAX_STATE_CODE


def has_codes_of_all(places: int, slots: int, operations: int = 0) -> bool:
    """Whether the states of a search in which anything may stand anywhere fit into 62-bit codes."""
    return (places * (slots + 1) << operations) * (places + 1) ** slots < MAX_STATE_CODE


def sequential_plan(problem: Problem, attempt: Attempt) -> tuple[float, Ints] | None:
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
