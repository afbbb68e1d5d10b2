"""The arrays of a recipe for the compiled search: distances, errand costs, slots and operations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from workbench.arrays import Floats, Ints
from workbench.planning.builtin.recipes import Operation, Recipe
from workbench.planning.builtin.search_interface import RecipeArrays
from workbench.planning.problem import PlanningItem, Problem
from workbench.worlds.house import LocationId

if TYPE_CHECKING:
    from workbench.planning.builtin.find_routes import FindRoutes

MAX_POTENTIALS = 3
"""Number of places whose distances serve as potentials of the heuristic."""


def arrays_of(problem: Problem, recipe: Recipe, routes: FindRoutes) -> RecipeArrays:
    """A recipe as arrays over the problem's locations."""
    where = {location: i for i, location in enumerate(problem.locations)}
    rows = problem.travel.rows(problem.locations)
    d = problem.travel.metres[rows[:, None], rows]
    op_slot, op_where, op_after, link = _operations(recipe) if recipe.operations else EMPTY_OPERATIONS
    centres = sorted({where[slot.end] for slot in recipe.slots if slot.end})[:MAX_POTENTIALS]
    potential = np.zeros((1 + len(centres), len(rows)))
    potential[1:] = d[:, centres].T
    fetch, least, standing = _errands(problem, recipe, routes, where, d, potential)
    return RecipeArrays(
        d=d,
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
        c=problem.costs.manipulation,
    )


def routes_of(problem: Problem) -> FindRoutes:
    """How a missing thing of each type is got from each of the problem's locations to each."""
    from workbench.planning.builtin.find_routes import find_routes

    rows = problem.travel.rows(problem.locations)
    return find_routes(find_tables(problem), problem.travel.metres[rows[:, None], rows])


def _errands(
    problem: Problem,
    recipe: Recipe,
    routes: FindRoutes,
    where: dict[LocationId, int],
    d: Floats,
    potential: Floats,
) -> tuple[Floats, Floats, Ints]:
    """fetch, least and standing of RecipeArrays."""
    from workbench.planning.builtin.lower_bounds import errand_costs

    things = {thing.id: thing for thing in problem.things}
    at = np.full((len(recipe.slots), max((len(slot.things) for slot in recipe.slots), default=0)), -1)
    find = np.full_like(at, -1)
    for s, slot in enumerate(recipe.slots):
        for j, name in enumerate(slot.things):
            place = place_of(problem, things[name])
            if place is not None:
                at[s, j] = where[place]
            elif problem.find_costs is not None:
                find[s, j] = problem.find_costs.item_types.index(things[name].type)
    return errand_costs(at, find, routes.metres, d, potential, problem.costs.manipulation)


def find_tables(problem: Problem) -> Floats:
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


def _operations(recipe: Recipe) -> tuple[Ints, Ints, Ints, Ints]:
    """op_slot, op_where, op_after and link of RecipeArrays."""
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


def _links(recipe: Recipe) -> Ints:
    """Pairs of consecutive operations that share a standing slot; see RecipeArrays."""
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


def place_of(problem: Problem, thing: PlanningItem) -> LocationId | None:
    """Where an item stands once the hand is free; None if it is missing."""
    return problem.robot_at if thing.held else thing.at
