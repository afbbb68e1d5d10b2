"""The paper's five scenarios and their variants: seeded tasks for any house that supports them.

A task names item types, never instances; every type that it names exists in the house. If a house cannot support a
scenario, the error says what it lacks.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from workbench.errors import BadValue, UnknownName
from workbench.planning.actions import COFFEE_MAKERS, producers
from workbench.planning.scenarios.house_items import SERVING_TYPES, ScenarioUnsupported, add_item, was_added
from workbench.planning.tasks import Added, AllOf, AnyOf, Delivered, Goal, Task, find_task
from workbench.worlds.house import START, ContainerId, House, ItemType, LocationId
from workbench.worlds.names import can_carry, readable_name
from workbench.worlds.travel import TravelCosts

SCENARIOS = ("deliver-3", "breakfast", "coffee", "breakfast+coffee", "any-of-three")
"""The paper's five, in the order of its table."""

PAPER_TITLES: Mapping[str, str] = MappingProxyType(
    {
        "deliver-3": "Deliver 3-Object",
        "breakfast": "Breakfast",
        "coffee": "Coffee",
        "breakfast+coffee": "Breakfast+Coffee",
        "any-of-three": "Any-of-Three",
    }
)

FAILURE_COSTS: Mapping[str, float] = MappingProxyType(
    {"find": 400.0, "deliver": 400.0, "breakfast": 400.0, "coffee": 450.0, "breakfast+coffee": 450.0, "any-of": 100.0}
)
BUDGETS_S: Mapping[str, float] = MappingProxyType(
    {"find": 120.0, "deliver": 120.0, "breakfast": 120.0, "coffee": 240.0, "breakfast+coffee": 240.0, "any-of": 120.0}
)
"""The paper's R_fail and t_max, by family."""

EGG, BOWL, PLATE, BREAD, MUG = (ItemType(name) for name in ("Egg", "Bowl", "Plate", "Bread", "Mug"))
GRINDS, WATER_BOTTLE = ItemType("CoffeeGrinds"), ItemType("WaterBottle")
TO_PEEL = tuple(ItemType(name) for name in ("Apple", "Potato", "Tomato"))

GRINDS_CONTAINER_TYPES = ("DiningTable", "CounterTop", "ShelvingUnit")
BOTTLE_CONTAINER_TYPES = ("Fridge", "DiningTable")
"""Container types that receive what Coffee adds to a house (paper, Sec. V; docs/planning.md)."""

COFFEE_ITEMS = (
    Added(item_type=GRINDS, stands=GRINDS_CONTAINER_TYPES),
    Added(item_type=WATER_BOTTLE, stands=BOTTLE_CONTAINER_TYPES),
)

MAX_ITEMS = 60


def make_task(scenario: str, house: House, *, seed: int, travel: TravelCosts | None = None) -> Task:
    """A task of a scenario in a house; the same seed gives the same task.

    Args:
        scenario: "find", "deliver-N", "breakfast", "coffee", "breakfast+coffee", "any-of-N" (N from 1 to 60, in
            figures or in words up to three), or the path of a scenario file (.yaml, .yml).
        house: prepared by with_scenario_items.
        travel: travel costs; if given, the task uses only reachable items and places.

    Raises:
        ScenarioUnsupported: the house lacks what it needs.
        UnknownName, BadValue: no such scenario, or N out of range.
        MalformedFile: a scenario file with a mistake; the message names line and column.
    """
    if is_scenario_file(scenario):
        from workbench.planning.scenarios.yaml_files import task_from_file

        return task_from_file(Path(scenario), house, seed=seed, travel=travel)
    family, count = family_of(scenario)
    rng = np.random.default_rng(seed)
    choices = _TaskSampler(house=house, scenario=scenario, travel=travel, rng=rng)
    if family == "find":
        item_type = choices.draw_types(1)[0]
        task = find_task(item_type, START)
    else:
        goal, title = _goal(family, count, choices)
        task = Task(
            scenario=scenario_name(scenario),
            goal=goal,
            failure_cost=FAILURE_COSTS[family],
            budget_s=BUDGETS_S[family],
            title=title,
        )
    added = COFFEE_ITEMS if "coffee" in family else ()
    return replace(task, available=choices.types, added=tuple(a for a in added if was_added(house, a.item_type)))


def with_scenario_items(scenario: str, house: House, *, seed: int) -> House:
    """The house with what the scenario adds: coffee grinds and a water bottle for coffee, nothing for others.

    Items that the house holds already are not added again. The same seed gives the same places.

    Raises:
        ScenarioUnsupported: no container of a suitable type.
    """
    if is_scenario_file(scenario):
        from workbench.planning.scenarios.yaml_files import house_from_file

        return house_from_file(Path(scenario), house, seed=seed)
    if "coffee" not in scenario.lower():
        return house
    rng = np.random.default_rng((seed, 1))
    for added in COFFEE_ITEMS:
        house = add_item(house, added.item_type, added.stands, scenario=scenario, rng=rng)
    return house


def is_scenario_file(scenario: str) -> bool:
    return scenario.lower().endswith((".yaml", ".yml"))


def scenario_name(scenario: str) -> str:
    """The canonical name of a scenario, as in logs and tables: "any-of-three" for "Any-of-3"."""
    family, count = family_of(scenario)
    if family == "deliver":
        return f"deliver-{count}"
    if family == "any-of":
        return f"any-of-{_WORDS[count - 1] if count <= len(_WORDS) else count}"
    return family


def family_of(scenario: str) -> tuple[str, int]:
    """The family and the item count of a scenario: ("deliver", 3) for "deliver-3"; the count is 0 if the scenario
    has none.

    Raises:
        UnknownName: no such scenario.
        BadValue: a count outside 1..MAX_ITEMS.
    """
    name = scenario.strip().lower()
    if name in ("find", "breakfast", "coffee", "breakfast+coffee"):
        return name, 0
    match = re.fullmatch(r"(deliver|any-of)-(\d{1,6}|one|two|three)", name)
    if match is None:
        raise UnknownName("scenario", scenario, ("find", *SCENARIOS, "deliver-N", "any-of-N", "FILE.yaml"))
    count = _WORDS.index(match[2]) + 1 if match[2] in _WORDS else int(match[2])
    if not 1 <= count <= MAX_ITEMS:
        raise BadValue(f"number of items in scenario {scenario}", count, f"from 1 to {MAX_ITEMS}")
    return match[1], count


_WORDS = ("one", "two", "three")


class _TaskSampler:
    """Draws item types and places of one house; only reachable ones if travel costs are given."""

    def __init__(self, *, house: House, scenario: str, travel: TravelCosts | None, rng: np.random.Generator) -> None:
        self.house, self.scenario, self.rng = house, scenario, rng
        self.places: tuple[ContainerId, ...] = tuple(
            c.id for c in house.plan.containers if travel is None or travel.reaches(LocationId(c.id))
        )
        held = {item.type for place in self.places for item in house.contents[place]}
        self.types = tuple(sorted(item_type for item_type in held if can_carry(item_type)))

    def draw_types(self, count: int) -> tuple[ItemType, ...]:
        if len(self.types) < count:
            raise self.unsupported(f"{len(self.types)} item types that can be carried")
        drawn = self.rng.choice(len(self.types), size=count, replace=False)
        return tuple(self.types[int(i)] for i in drawn)

    def draw_targets(self, types: tuple[ItemType, ...]) -> tuple[LocationId, ...]:
        """A target for each type: all different, and none that holds the type already."""
        targets: list[LocationId] = []
        for item_type in types:
            holders = self.house.holders(item_type)
            free = [place for place in self.places if place not in holders and LocationId(place) not in targets]
            if not free:
                raise self.unsupported("too few containers")
            targets.append(LocationId(free[int(self.rng.integers(len(free)))]))
        return tuple(targets)

    def serving_place(self) -> LocationId:
        for kind in SERVING_TYPES:
            places = [c.id for c in self.house.plan.containers if c.type == kind and c.id in self.places]
            if places:
                return LocationId(places[int(self.rng.integers(len(places)))])
        raise self.unsupported("no " + ", ".join(readable_name(kind) for kind in SERVING_TYPES))

    def has(self, item_type: ItemType) -> bool:
        return item_type in self.types

    def unsupported(self, lacks: str) -> ScenarioUnsupported:
        return ScenarioUnsupported(self.house.plan.name, self.scenario, lacks)


def _goal(family: str, count: int, choices: _TaskSampler) -> tuple[Goal, str]:
    if family == "deliver":
        types = choices.draw_types(count)
        parts = tuple(Delivered(item_type=t, at=a) for t, a in zip(types, choices.draw_targets(types), strict=True))
        words = ", ".join(f"{readable_name(part.item_type)} to {part.at}" for part in parts)
        return AllOf(parts=parts), f"deliver {words}"
    if family == "any-of":
        types = choices.draw_types(count)
        parts = tuple(Delivered(item_type=t, at=START) for t in types)
        return AnyOf(parts=parts), "bring any of " + ", ".join(readable_name(t) for t in types) + " to the start"
    place = choices.serving_place()
    if family == "breakfast":
        return _breakfast(choices, place), f"serve breakfast at {place}"
    if family == "coffee":
        return _coffee(choices, place), f"serve coffee at {place}"
    both = AllOf(parts=(_breakfast(choices, place), _coffee(choices, place)))
    return both, f"serve breakfast and coffee at {place}"


def _breakfast(choices: _TaskSampler, place: LocationId) -> Goal:
    """A boiled egg in a bowl; a peeled potato, tomato or apple on a plate; toasted bread on a plate."""
    dishes = (
        (EGG, "boiled", BOWL),
        *((food, "peeled", PLATE) for food in TO_PEEL),
        (BREAD, "toasted", PLATE),
    )
    alternatives = tuple(
        AllOf(
            parts=(
                Delivered(item_type=food, at=place, properties=(prop,)),
                Delivered(item_type=dish, at=place),
            )
        )
        for food, prop, dish in dishes
        if choices.has(food) and choices.has(dish) and _can_prepare(choices, food, prop)
    )
    if not alternatives:
        raise choices.unsupported("nothing that breakfast can be made of")
    return AnyOf(parts=alternatives)


def _coffee(choices: _TaskSampler, place: LocationId) -> Goal:
    """A mug of coffee: grinds, water, and a coffee machine, kettle or pot."""
    lacks = [readable_name(t) for t in (MUG, GRINDS, WATER_BOTTLE) if not choices.has(t)]
    if not any(choices.has(maker) for maker in COFFEE_MAKERS):
        lacks.append("coffee machine, kettle or pot")
    if lacks:
        raise choices.unsupported("no " + ", no ".join(lacks))
    return Delivered(item_type=MUG, at=place, properties=("coffee",))


def _can_prepare(choices: _TaskSampler, item_type: ItemType, prop: str) -> bool:
    return any(
        all(any(choices.has(t) for t in part.types) for i, part in enumerate(preparation.parts) if i != index)
        for preparation, index in producers(item_type, prop)
    )
