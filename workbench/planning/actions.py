"""The table of preparing actions: the items that each needs and the properties that it gives.

move, pick, place and find are built into the robot; everything else is a Preparation below. A new action is one
more entry: PDDL, SAS+, the built-in solver, the execution loop and the scenario files read this table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Literal

from workbench.planning.plans import PlanStep
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal
from workbench.worlds.house import ItemType
from workbench.worlds.knowledge import Fact


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One item that takes part in a preparation.

    Attributes:
        role: its role in the action, such as "food" or "vessel".
        types: the item types that can fill the role.
        where: "here" if it stands at the robot's location, "hand" if the robot holds it.
        needs: properties required beforehand.
        gains: properties added by the action.
    """

    role: str
    types: tuple[ItemType, ...]
    where: Literal["here", "hand"] = "here"
    needs: tuple[str, ...] = ()
    gains: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Preparation:
    """An action on items at one location, at the cost of one manipulation. Parts are in the order of a step's
    items."""

    name: str
    parts: tuple[Part, ...]


def _types(*names: str) -> tuple[ItemType, ...]:
    return tuple(ItemType(name) for name in names)


VESSELS = _types("Kettle", "Pot")
COFFEE_MAKERS = _types("CoffeeMachine", "Kettle", "Pot")

PREPARATIONS: tuple[Preparation, ...] = (
    Preparation(
        name="boil",
        parts=(Part(role="food", types=_types("Egg"), gains=("boiled",)), Part(role="vessel", types=VESSELS)),
    ),
    Preparation(
        name="peel",
        parts=(
            Part(role="food", types=_types("Apple", "Potato", "Tomato"), gains=("peeled",)),
            Part(role="knife", types=_types("Knife"), where="hand"),
        ),
    ),
    Preparation(
        name="toast",
        parts=(
            Part(role="bread", types=_types("Bread"), gains=("toasted",)),
            Part(role="toaster", types=_types("Toaster")),
        ),
    ),
    Preparation(
        name="pour-water",
        parts=(
            Part(role="bottle", types=_types("WaterBottle"), where="hand"),
            Part(role="vessel", types=COFFEE_MAKERS, gains=("filled",)),
        ),
    ),
    Preparation(
        name="make-coffee",
        parts=(
            Part(role="grinds", types=_types("CoffeeGrinds")),
            Part(role="vessel", types=COFFEE_MAKERS, needs=("filled",), gains=("brewed",)),
        ),
    ),
    Preparation(
        name="pour-coffee",
        parts=(
            Part(role="vessel", types=COFFEE_MAKERS, needs=("brewed",)),
            Part(role="cup", types=_types("Mug"), gains=("coffee",)),
        ),
    ),
)
"""The paper's preparing actions (Sec. V, "Action Costs"). To pour coffee, the vessel must stand at the cup's
location."""

BY_NAME: Mapping[str, Preparation] = MappingProxyType({p.name: p for p in PREPARATIONS})

EFFECTS: Mapping[str, tuple[str, int]] = MappingProxyType(
    {p.name: (part.gains[0], i) for p in PREPARATIONS for i, part in enumerate(p.parts) if part.gains}
)
"""Action name -> (property, index of the item that gains it among the step's items)."""

ACTION_NAMES: tuple[str, ...] = ("move", "pick", "place", "find", *(p.name for p in PREPARATIONS))


def facts_after(step: PlanStep, facts: frozenset[Fact]) -> frozenset[Fact]:
    """The facts after a preparing step.

    Raises:
        KeyError: the step is not a preparation.
    """
    prop, index = EFFECTS[step.action]
    return facts | {(prop, (step.items[index],))}


def producers(item_type: ItemType, prop: str) -> tuple[tuple[Preparation, int], ...]:
    """The preparations that give a property to an item type, each with the index of the part that gains it."""
    return tuple(
        (preparation, i)
        for preparation in PREPARATIONS
        for i, part in enumerate(preparation.parts)
        if prop in part.gains and item_type in part.types
    )


@lru_cache(maxsize=256)
def relevant_types(goal: Goal) -> tuple[ItemType, ...]:
    """The item types that a goal may need, including those of its preparations; sorted."""
    needed: dict[tuple[ItemType, str], None] = {}
    _need(goal, needed)
    return tuple(sorted({item_type for item_type, _ in needed}))


@lru_cache(maxsize=256)
def prepares(goal: Goal) -> bool:
    """Whether some part of the goal asks for a property that a preparation provides."""
    if isinstance(goal, AllOf | AnyOf):
        return any(prepares(part) for part in goal.parts)
    given = {prop for prop, _ in EFFECTS.values()}
    return isinstance(goal, Delivered) and any(prop in given for prop in goal.properties)


def _need(goal: Goal, needed: dict[tuple[ItemType, str], None]) -> None:
    if isinstance(goal, AllOf | AnyOf):
        for part in goal.parts:
            _need(part, needed)
        return
    _need_type(goal.item_type, (), needed)
    _need_type(goal.item_type, getattr(goal, "properties", ()), needed)


def _need_type(item_type: ItemType, properties: tuple[str, ...], needed: dict[tuple[ItemType, str], None]) -> None:
    if not properties:
        needed[item_type, ""] = None
    for prop in properties:
        if (item_type, prop) in needed:
            continue
        needed[item_type, prop] = None
        for preparation, index in producers(item_type, prop):
            _need_type(item_type, preparation.parts[index].needs, needed)
            for i, part in enumerate(preparation.parts):
                if i != index:
                    for other in part.types:
                        _need_type(other, (), needed)
                        _need_type(other, part.needs, needed)
