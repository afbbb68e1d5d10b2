"""In which ways can a goal be met? Recipes: which things, which preparations, what must end where.

A recipe has slots (a thing of a type, to be chosen among its instances) and operations on them. Breakfast+Coffee
has eighteen: boil in a pot or a kettle, peel one of three, toast, each with coffee from one of three makers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeVar

from workbench.planning.actions import Preparation, producers
from workbench.planning.problem import MISSING, Problem, ways_of
from workbench.planning.tasks import Delivered, Goal, Holding, goal_locations
from workbench.worlds.house import ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Fact

T = TypeVar("T")

MOST_RECIPES = 4000
"""Beyond, the others are left out, and no plan is proven optimal."""
MOST_REMEMBERED = 256
"""Problems whose recipes are remembered: replanning and replay ask for the same ones with things elsewhere."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Slot:
    """A thing that a recipe uses.

    Attributes:
        has: properties that it must have already.
        end: where it must stand at the end, None when that does not matter.
        in_hand: at the end it is held there instead of standing.
        things: instances that can fill it, sorted.
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
    slots: tuple[Slot, ...] = ()
    operations: tuple[Operation, ...] = ()

    @property
    def title(self) -> str:
        """For people: "boil Egg, Pot; Bowl"."""
        used = {slot for operation in self.operations for slot in operation.slots}
        done = [
            f"{operation.preparation.name} {', '.join(self.slots[slot].type for slot in operation.slots)}"
            for operation in self.operations
        ]
        return "; ".join([*done, *(slot.type for i, slot in enumerate(self.slots) if i not in used)])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Given:
    """All of a problem that its recipes depend on: not where things stand, nor what finding them costs.

    Attributes:
        things: with their types, sorted by id.
        reached: the goal's places that can be reached.
    """

    goal: Goal
    things: tuple[tuple[ItemId, ItemType], ...]
    facts: frozenset[Fact]
    reached: tuple[LocationId, ...]

    def of_type(self, item_type: ItemType) -> tuple[ItemId, ...]:
        return tuple([name for name, its_type in self.things if its_type == item_type])


@dataclass(frozen=True, slots=True)
class _Open:
    """A property that some slot still has to get, before operation `before`."""

    slot: int
    prop: str
    before: int | None


def recipes_of(problem: Problem) -> tuple[Recipe, ...]:
    """Every recipe that the problem's things can fill, in an order that does not change."""
    given = _Given(
        goal=problem.goal,
        things=tuple([(thing.id, thing.type) for thing in problem.things]),
        facts=problem.facts,
        reached=tuple([place for place in goal_locations(problem.goal) if problem.travel.reaches(place)]),
    )
    return _recipes(given)


@lru_cache(maxsize=MOST_REMEMBERED)
def _recipes(given: _Given) -> tuple[Recipe, ...]:
    found: dict[Recipe, None] = {}
    for way in ways_of(given.goal):
        if sum(isinstance(want, Holding) for want in way) > 1 or not all(want.at in given.reached for want in way):
            continue
        slots = tuple(Slot(type=want.item_type, end=want.at, in_hand=isinstance(want, Holding)) for want in way)
        wanted = tuple(
            _Open(i, prop, None)
            for i, want in enumerate(way)
            if isinstance(want, Delivered)
            for prop in want.properties
        )
        for recipe in _expand(Recipe(slots=slots), wanted, given):
            for filled in _filled(_first_things_first(recipe), given):
                found[filled] = None
                if len(found) >= MOST_RECIPES:
                    return tuple(found)
    return tuple(found)


def _expand(recipe: Recipe, wanted: tuple[_Open, ...], given: _Given) -> list[Recipe]:
    """All ways of giving the wanted properties: by an instance that has it, or by a preparation."""
    if not wanted:
        return [recipe]
    head, rest = wanted[0], wanted[1:]
    slot = recipe.slots[head.slot]
    made = [i for i, op in enumerate(recipe.operations) if _gives(op, head.slot, head.prop)]
    if made:
        return _expand(_ordered(recipe, head.before, made[0]), rest, given)
    grown: list[Recipe] = []
    has = replace(slot, has=slot.has | {head.prop})
    if any(_fits(has, thing, given) for thing in given.of_type(slot.type)):
        grown += _expand(replace(recipe, slots=_with(recipe.slots, head.slot, has)), rest, given)
    for preparation, index in producers(slot.type, head.prop):
        for parts, slots in _cast(preparation, index, head.slot, recipe.slots, given):
            number = len(recipe.operations)
            operations = (*recipe.operations, Operation(preparation=preparation, slots=parts))
            more = _ordered(replace(recipe, slots=slots, operations=operations), head.before, number)
            needs = tuple(
                _Open(parts[i], prop, number) for i, part in enumerate(preparation.parts) for prop in part.needs
            )
            grown += _expand(more, (*needs, *rest), given)
    return grown


def _first_things_first(recipe: Recipe) -> Recipe:
    """The recipe with every operation behind those that it comes after."""
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


def _gives(operation: Operation, slot: int, prop: str) -> bool:
    pairs = zip(operation.slots, operation.preparation.parts, strict=True)
    return any(s == slot and prop in part.gains for s, part in pairs)


def _ordered(recipe: Recipe, before: int | None, number: int) -> Recipe:
    """The recipe with operation `number` ahead of operation `before`."""
    if before is None:
        return recipe
    operation = recipe.operations[before]
    later = replace(operation, after=tuple(sorted({*operation.after, number})))
    return replace(recipe, operations=_with(recipe.operations, before, later))


def _cast(
    preparation: Preparation, index: int, slot: int, slots: tuple[Slot, ...], given: _Given
) -> list[tuple[tuple[int, ...], tuple[Slot, ...]]]:
    """Who plays which part: a slot that the recipe has already, or a new one of each type that things exist of."""
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


def _filled(recipe: Recipe, given: _Given) -> Iterator[Recipe]:
    """The recipe with its slots' instances; where two slots share a type, one recipe for each assignment.

    Slots that ask for the same and are used by no operation are interchangeable: they take theirs in one order only.
    So are things of a type that are still to be found: the first that is left stands for all.
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


def _fits(slot: Slot, thing: ItemId, given: _Given) -> bool:
    return all((prop, (thing,)) in given.facts for prop in slot.has)


def _with(items: tuple[T, ...], index: int, item: T) -> tuple[T, ...]:
    return (*items[:index], item, *items[index + 1 :])
