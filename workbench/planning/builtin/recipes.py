"""Recipes: the ways of meeting a goal, each with its items, preparations and final locations.

A recipe has slots (an item of a type, to be chosen among its instances) and operations on them. Breakfast+coffee
has eighteen recipes: boil in one of two vessels, peel one of three foods, and make coffee with one of three makers;
the toast is always the same.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

from workbench.planning.actions import Preparation, producers
from workbench.planning.problem import MISSING, Problem, goal_alternatives
from workbench.planning.tasks import Delivered, Goal, Holding, goal_locations
from workbench.worlds.house import ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Fact

T = TypeVar("T")

MAX_RECIPES = 4000
"""Beyond this number recipes are left out, and no plan is proven optimal."""
RECIPE_CACHE_SIZE = 256
"""Number of problems whose recipes are cached: replanning and replay ask for the same recipes with items elsewhere.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Slot:
    """An item that a recipe uses.

    Attributes:
        has: properties that it must have from the start.
        end: where it must be at the end; None if that does not matter.
        in_hand: whether it must be held there at the end.
        things: ids of the instances that can fill it, sorted.
    """

    type: ItemType
    has: frozenset[str] = frozenset()
    end: LocationId | None = None
    in_hand: bool = False
    things: tuple[ItemId, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Operation:
    """A preparation on slots; `after` are indices of operations that must come before."""

    preparation: Preparation
    slots: tuple[int, ...]
    after: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """One way of meeting the goal: the items that it uses, and the preparations in which they take part."""

    slots: tuple[Slot, ...] = ()
    operations: tuple[Operation, ...] = ()

    @property
    def title(self) -> str:
        """A title for display: "boil Egg, Pot; Bowl"."""
        used = {slot for operation in self.operations for slot in operation.slots}
        done = [
            f"{operation.preparation.name} {', '.join(self.slots[slot].type for slot in operation.slots)}"
            for operation in self.operations
        ]
        return "; ".join([*done, *(slot.type for i, slot in enumerate(self.slots) if i not in used)])


@dataclass(frozen=True, slots=True, kw_only=True)
class _RecipeInputs:
    """The parts of a problem that its recipes depend on (the cache key): neither item locations nor find costs.

    Attributes:
        things: items with their types, sorted by id.
        reached: reachable locations of the goal.
    """

    goal: Goal
    things: tuple[tuple[ItemId, ItemType], ...]
    facts: frozenset[Fact]
    reached: tuple[LocationId, ...]

    def of_type(self, item_type: ItemType) -> tuple[ItemId, ...]:
        return tuple([name for name, its_type in self.things if its_type == item_type])


@dataclass(frozen=True, slots=True)
class _OpenProperty:
    """A property that a slot must still gain, before operation `before`."""

    slot: int
    prop: str
    before: int | None


def recipes_of(problem: Problem) -> tuple[Recipe, ...]:
    """Every recipe that the problem's items can fill, in a deterministic order."""
    given = _RecipeInputs(
        goal=problem.goal,
        things=tuple([(thing.id, thing.type) for thing in problem.things]),
        facts=problem.facts,
        reached=tuple([place for place in goal_locations(problem.goal) if problem.travel.reaches(place)]),
    )
    return _recipes(given)


@lru_cache(maxsize=RECIPE_CACHE_SIZE)
def _recipes(given: _RecipeInputs) -> tuple[Recipe, ...]:
    found: dict[Recipe, None] = {}
    for alternative in goal_alternatives(given.goal):
        if sum(isinstance(want, Holding) for want in alternative) > 1 or not all(
            want.at in given.reached for want in alternative
        ):
            continue
        slots = tuple(
            Slot(type=want.item_type, end=want.at, in_hand=isinstance(want, Holding)) for want in alternative
        )
        wanted = tuple(
            _OpenProperty(i, prop, None)
            for i, want in enumerate(alternative)
            if isinstance(want, Delivered)
            for prop in want.properties
        )
        for recipe in _expand(Recipe(slots=slots), wanted, given):
            for filled in _with_instances(_topologically_sorted(recipe), given):
                found[filled] = None
                if len(found) >= MAX_RECIPES:
                    return tuple(found)
    return tuple(found)


def _expand(recipe: Recipe, wanted: tuple[_OpenProperty, ...], given: _RecipeInputs) -> list[Recipe]:
    """All ways of providing the required properties: by an instance that has them, or by a preparation."""
    if not wanted:
        return [recipe]
    head, rest = wanted[0], wanted[1:]
    slot = recipe.slots[head.slot]
    made = [i for i, op in enumerate(recipe.operations) if _provides(op, head.slot, head.prop)]
    if made:
        return _expand(_ordered(recipe, head.before, made[0]), rest, given)
    grown: list[Recipe] = []
    has = replace(slot, has=slot.has | {head.prop})
    if any(_fits(has, thing, given) for thing in given.of_type(slot.type)):
        grown += _expand(replace(recipe, slots=_replace_item(recipe.slots, head.slot, has)), rest, given)
    for preparation, index in producers(slot.type, head.prop):
        for parts, slots in _assign_parts(preparation, index, head.slot, recipe.slots, given):
            number = len(recipe.operations)
            operations = (*recipe.operations, Operation(preparation=preparation, slots=parts))
            more = _ordered(replace(recipe, slots=slots, operations=operations), head.before, number)
            needs = tuple(
                _OpenProperty(parts[i], prop, number)
                for i, part in enumerate(preparation.parts)
                for prop in part.needs
            )
            grown += _expand(more, (*needs, *rest), given)
    return grown


def _topologically_sorted(recipe: Recipe) -> Recipe:
    """The recipe with its operations in topological order."""
    if not recipe.operations:
        return recipe
    order: list[int] = []
    while len(order) < len(recipe.operations):
        ready = (
            i
            for i, op in enumerate(recipe.operations)
            if i not in order and all(before in order for before in op.after)
        )
        order.append(next(ready))
    operations = tuple(
        replace(
            recipe.operations[i], after=tuple(sorted(order.index(before) for before in recipe.operations[i].after))
        )
        for i in order
    )
    return replace(recipe, operations=operations)


def _provides(operation: Operation, slot: int, prop: str) -> bool:
    pairs = zip(operation.slots, operation.preparation.parts, strict=True)
    return any(s == slot and prop in part.gains for s, part in pairs)


def _ordered(recipe: Recipe, before: int | None, number: int) -> Recipe:
    """The recipe with the constraint that operation `number` precedes operation `before`."""
    if before is None:
        return recipe
    operation = recipe.operations[before]
    later = replace(operation, after=tuple(sorted({*operation.after, number})))
    return replace(recipe, operations=_replace_item(recipe.operations, before, later))


def _assign_parts(
    preparation: Preparation, index: int, slot: int, slots: tuple[Slot, ...], given: _RecipeInputs
) -> list[tuple[tuple[int, ...], tuple[Slot, ...]]]:
    """All assignments of parts to slots: to an existing slot of the recipe, or to a new slot of each available
    type."""
    castings: list[tuple[tuple[int, ...], tuple[Slot, ...]]] = [((), slots)]
    for i, part in enumerate(preparation.parts):
        following: list[tuple[tuple[int, ...], tuple[Slot, ...]]] = []
        for chosen, current in castings:
            if i == index:
                following.append(((*chosen, slot), current))
                continue
            for item_type in part.types:
                same = [s for s, other in enumerate(current) if other.type == item_type and s not in (*chosen, slot)]
                following += [((*chosen, s), current) for s in same]
                if len(given.of_type(item_type)) > sum(other.type == item_type for other in current):
                    following.append(((*chosen, len(current)), (*current, Slot(type=item_type))))
        castings = following
    return castings


def _with_instances(recipe: Recipe, given: _RecipeInputs) -> Iterator[Recipe]:
    """The recipe with instances for its slots; where two slots share a type, one recipe per assignment.

    Symmetries are broken: slots with equal requirements and no operation take their instances in one order only,
    and of the missing items of a type the first unused one represents all.
    """
    fitting = [tuple(t for t in given.of_type(slot.type) if _fits(slot, t, given)) for slot in recipe.slots]
    types = [slot.type for slot in recipe.slots]
    used = {slot for operation in recipe.operations for slot in operation.slots}
    alike = [
        [j for j, other in enumerate(recipe.slots) if other == slot and i not in used and j not in used] or [i]
        for i, slot in enumerate(recipe.slots)
    ]

    def fill(filled: tuple[Slot, ...]) -> Iterator[tuple[Slot, ...]]:
        i = len(filled)
        if i == len(recipe.slots):
            yield filled
            return
        slot, things = recipe.slots[i], fitting[i]
        if types.count(slot.type) == 1:
            if things:
                yield from fill((*filled, replace(slot, things=things)))
            return
        before = [j for j in alike[i] if j < i]
        first = things.index(filled[before[-1]].things[0]) + 1 if before else 0
        last = len(things) - sum(j > i for j in alike[i])
        taken = {name for other in filled for name in other.things}
        left = [thing for thing in things[first:last] if thing not in taken]
        unknown = [thing for thing in left if thing.startswith(MISSING)]
        for thing in left:
            if thing not in unknown[1:]:
                yield from fill((*filled, replace(slot, things=(thing,))))

    for slots in fill(()):
        yield replace(recipe, slots=slots)


def _fits(slot: Slot, thing: ItemId, given: _RecipeInputs) -> bool:
    return all((prop, (thing,)) in given.facts for prop in slot.has)


def _replace_item(items: tuple[T, ...], index: int, item: T) -> tuple[T, ...]:
    return (*items[:index], item, *items[index + 1 :])
