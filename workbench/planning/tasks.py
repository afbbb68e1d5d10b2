"""What shall the robot do? Goals over item types with alternatives; any instance of a type serves."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod

from workbench.errors import BadValue
from workbench.worlds.house import ItemType, LocationId

MOST_WAYS = 5_000
"""Each is planned for; more take longer than a planning budget."""


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
    """Every part holds, each met by an instance of its own where two parts ask for the same type."""

    parts: tuple[Goal, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnyOf:
    """At least one part holds."""

    parts: tuple[Goal, ...]


Goal = Delivered | Holding | AllOf | AnyOf


@dataclass(frozen=True, slots=True, kw_only=True)
class Added:
    """What a scenario has put into the house: one item, in a container of one of these types."""

    item_type: ItemType
    stands: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Task:
    """One household task.

    Attributes:
        scenario: "find", "deliver-3", "breakfast", "coffee", "breakfast+coffee", "any-of-three", or a user's.
        goal: what must hold at the end.
        failure_cost: charged instead of the run's own cost when the task is not done.
        budget_s: planning seconds for the whole run; more fails it.
        title: one line for people.
        available: the item types that are known to exist in the place (the paper's prior knowledge, Sec. III),
            sorted: no other is searched for. Empty when that is not known; then every type may be.
        added: what the scenario has put there itself; where it may stand is known (added.py).
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
        if count_ways(self.goal) > MOST_WAYS:
            where = f"number of ways to meet the goal of {self.scenario}"
            raise BadValue(where, count_ways(self.goal), f"at most {MOST_WAYS}: write fewer alternatives")


def count_ways(goal: Goal) -> int:
    """In how many ways a goal can be met: alternatives add up, parts multiply."""
    if isinstance(goal, AnyOf):
        return sum(count_ways(part) for part in goal.parts)
    if isinstance(goal, AllOf):
        return prod(count_ways(part) for part in goal.parts)
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
