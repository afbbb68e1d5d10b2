"""Tasks: goals over item types, with alternatives. Any instance of a type serves."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod

from workbench.errors import BadValue
from workbench.worlds.house import ItemType, LocationId

MAX_ALTERNATIVES = 5_000
"""Most ways of meeting a goal; each is planned for, and more would exceed any planning budget."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Delivered:
    """Some instance of item_type stands at `at`, with all the given properties ("boiled", "toasted", ...)."""

    item_type: ItemType
    at: LocationId
    properties: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Holding:
    """The robot stands at `at` with some instance of item_type in its hand: the end of a single find."""

    item_type: ItemType
    at: LocationId


@dataclass(frozen=True, slots=True, kw_only=True)
class AllOf:
    """Every part holds; parts that ask for the same type are met by different instances."""

    parts: tuple[Goal, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnyOf:
    """At least one part holds."""

    parts: tuple[Goal, ...]


Goal = Delivered | Holding | AllOf | AnyOf


@dataclass(frozen=True, slots=True, kw_only=True)
class Added:
    """An item that a scenario has added to the house, in a container of one of these types."""

    item_type: ItemType
    stands: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One household task.

    Attributes:
        scenario: "find", "deliver-3", "breakfast", "coffee", "breakfast+coffee", "any-of-three", or a user's.
        goal: what must hold at the end.
        failure_cost: cost charged for a failed run, in place of its own cost.
        budget_s: planning time for the whole run in seconds; a run that exceeds it fails.
        title: one line for display.
        available: the item types known to exist in the house (prior knowledge, paper Sec. III), sorted; no
            other type is searched for. Empty if unknown; then any type may exist.
        added: items that the scenario has added; their possible containers are known (added_items.py).
    """

    scenario: str
    goal: Goal
    failure_cost: float
    budget_s: float
    title: str = ""
    available: tuple[ItemType, ...] = ()
    added: tuple[Added, ...] = ()

    def __post_init__(self) -> None:
        if self.budget_s < 0 or self.failure_cost < 0:
            raise BadValue(f"task {self.scenario}", (self.budget_s, self.failure_cost), "at least 0")
        if count_alternatives(self.goal) > MAX_ALTERNATIVES:
            where = f"number of ways to meet the goal of {self.scenario}"
            raise BadValue(
                where, count_alternatives(self.goal), f"at most {MAX_ALTERNATIVES}: write fewer alternatives"
            )


def count_alternatives(goal: Goal) -> int:
    """The number of ways to meet a goal: alternatives add up, parts multiply."""
    if isinstance(goal, AnyOf):
        return sum(count_alternatives(part) for part in goal.parts)
    if isinstance(goal, AllOf):
        return prod(count_alternatives(part) for part in goal.parts)
    return 1


def find_task(item_type: ItemType, at: LocationId, *, failure_cost: float = 400.0) -> Task:
    """Find an item type and bring it to a location, in hand: the paper's object search."""
    return Task(
        scenario="find",
        goal=Holding(item_type=item_type, at=at),
        failure_cost=failure_cost,
        budget_s=120.0,
        title=f"find {item_type} and bring it to {at}",
    )


def goal_types(goal: Goal) -> tuple[ItemType, ...]:
    """The item types that a goal names, sorted."""
    if isinstance(goal, AllOf | AnyOf):
        return tuple(sorted({t for part in goal.parts for t in goal_types(part)}))
    return (goal.item_type,)


def goal_locations(goal: Goal) -> tuple[LocationId, ...]:
    """The locations that a goal names, sorted."""
    if isinstance(goal, AllOf | AnyOf):
        return tuple(sorted({a for part in goal.parts for a in goal_locations(part)}))
    return (goal.at,)


def plain_deliveries(goal: Goal) -> tuple[Delivered, ...]:
    """The parts of a goal that asks for nothing but deliveries of things as they are; () for any other."""
    parts = goal.parts if isinstance(goal, AllOf) else (goal,)
    plain = tuple(part for part in parts if isinstance(part, Delivered) and not part.properties)
    return plain if len(plain) == len(parts) else ()


def distinct_deliveries(goal: Goal) -> tuple[Delivered, ...]:
    """The parts of a goal of plain deliveries, each of another type; () for any other."""
    plain = plain_deliveries(goal)
    return plain if len({part.item_type for part in plain}) == len(plain) else ()
