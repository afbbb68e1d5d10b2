"""The typed planning problem, from which every solver's input is generated, and its transition function.

It contains only what can matter: the locations, the items of relevant types, and hypothetical items of missing
types, which a find brings. PDDL, SAS+ and the built-in solver's arrays are generated from it, never edited.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType

from workbench.message_enum import MessageEnum, Result
from workbench.planning.actions import BY_NAME, relevant_types
from workbench.planning.matching import has_perfect_matching
from workbench.planning.plans import PlanStep
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding, goal_locations
from workbench.search.costs import ActionCosts
from workbench.search.find_costs import FindCosts
from workbench.worlds.house import ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Fact, Knowledge
from workbench.worlds.travel import TravelCosts

MISSING = "?"
"""Prefix of the ids of hypothetical items: "?Mug", "?Mug#2"."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningItem:
    """An item of the problem: a known instance, or a hypothetical one that a find brings.

    Attributes:
        at: its location; None if it is missing or held.
        held: whether it is in the robot's hand.
    """

    id: ItemId
    type: ItemType
    at: LocationId | None = None
    held: bool = False

    @property
    def missing(self) -> bool:
        return self.at is None and not self.held


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """The complete input of a solver.

    Attributes:
        locations: where the robot may stop, in a deterministic order; includes robot_at.
        things: sorted by id.
        find_costs: of every missing type, with all locations as origins and targets; None without finds.
    """

    travel: TravelCosts
    costs: ActionCosts
    locations: tuple[LocationId, ...]
    robot_at: LocationId
    things: tuple[PlanningItem, ...]
    facts: frozenset[Fact]
    goal: Goal
    find_costs: FindCosts | None = None

    def distance(self, a: LocationId, b: LocationId) -> float:
        return float(self.travel.metres[self.travel.index(a), self.travel.index(b)])

    def of_type(self, item_type: ItemType) -> tuple[PlanningItem, ...]:
        return tuple(thing for thing in self.things if thing.type == item_type)


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """A state during a plan: the locations of the robot and of all items, and the facts established by
    preparations."""

    robot_at: LocationId
    holding: ItemId | None
    places: Mapping[ItemId, LocationId] = field(hash=False)
    facts: frozenset[Fact] = frozenset()


def initial_state(problem: Problem) -> State:
    held = next((thing.id for thing in problem.things if thing.held), None)
    places = {thing.id: thing.at for thing in problem.things if thing.at is not None}
    return State(robot_at=problem.robot_at, holding=held, places=places, facts=problem.facts)


class IllegalStep(ValueError):
    """A step has a precondition that does not hold."""

    def __init__(self, step: PlanStep, why: str) -> None:
        super().__init__(f"'{step}' cannot be done: {why}")


def apply(step: PlanStep, state: State) -> State:
    """The state after a step; the step names hypothetical items by their ids.

    Raises:
        IllegalStep: a precondition does not hold.
    """
    if step.origin != state.robot_at:
        raise IllegalStep(step, f"the robot is at {state.robot_at}")
    if step.action == "move":
        return replace(state, robot_at=step.target)
    if not step.items:
        raise IllegalStep(step, "it names no item")
    item = step.items[0]
    if step.action in ("pick", "find"):
        return _apply_pick(step, state, item)
    if step.action == "place":
        if state.holding != item:
            raise IllegalStep(step, f"{item} is not in hand")
        return replace(state, holding=None, places={**state.places, item: state.robot_at})
    return _apply_preparation(step, state)


def _apply_pick(step: PlanStep, state: State, item: ItemId) -> State:
    if state.holding is not None:
        raise IllegalStep(step, f"the hand holds {state.holding}")
    if step.action == "pick" and state.places.get(item) != state.robot_at:
        raise IllegalStep(step, f"{item} is not here")
    if step.action == "find" and item in state.places:
        raise IllegalStep(step, f"{item} is not missing")
    left = {other: place for other, place in state.places.items() if other != item}
    return replace(state, robot_at=step.target, holding=item, places=left)


def _apply_preparation(step: PlanStep, state: State) -> State:
    preparation = BY_NAME.get(step.action)
    if preparation is None or len(step.items) != len(preparation.parts):
        raise IllegalStep(step, "there is no such action on so many items")
    if state.holding is not None and all(part.where == "here" for part in preparation.parts):
        raise IllegalStep(step, f"the hand holds {state.holding}")
    gained: set[Fact] = set()
    for part, item in zip(preparation.parts, step.items, strict=True):
        if part.where == "hand" and state.holding != item:
            raise IllegalStep(step, f"{item} is not in hand")
        if part.where == "here" and state.places.get(item) != state.robot_at:
            raise IllegalStep(step, f"{item} does not stand here")
        lacking = [prop for prop in part.needs if (prop, (item,)) not in state.facts]
        if lacking:
            raise IllegalStep(step, f"{item} is not {lacking[0]}")
        gained |= {(prop, (item,)) for prop in part.gains}
    return replace(state, facts=state.facts | gained)


def holds(goal: Goal, state: State, problem: Problem) -> bool:
    """Whether some assignment of different items to the goal's parts meets the goal."""
    return any(
        has_perfect_matching(
            [
                [t.id for t in problem.things if t.type == want.item_type and satisfies_want(want, t.id, state)]
                for want in alternative
            ]
        )
        for alternative in goal_alternatives(goal)
    )


def satisfies_want(want: Delivered | Holding, item: ItemId, state: State) -> bool:
    """Whether an item satisfies a want."""
    if isinstance(want, Holding):
        return state.holding == item and state.robot_at == want.at
    there = state.places.get(item) == want.at
    return there and all((prop, (item,)) in state.facts for prop in want.properties)


@lru_cache(maxsize=256)
def goal_alternatives(goal: Goal) -> tuple[tuple[Delivered | Holding, ...], ...]:
    """The goal as alternatives of wants that must all hold: its disjunctive normal form, without repetitions."""
    if isinstance(goal, AnyOf):
        return tuple(dict.fromkeys(alternative for part in goal.parts for alternative in goal_alternatives(part)))
    if isinstance(goal, AllOf):
        alternatives: tuple[tuple[Delivered | Holding, ...], ...] = ((),)
        for part in goal.parts:
            alternatives = tuple(
                (*alternative, *more) for alternative in alternatives for more in goal_alternatives(part)
            )
        return tuple(dict.fromkeys(alternatives))
    return ((goal,),)


def missing_types(
    goal: Goal, knowledge: Knowledge, available: tuple[ItemType, ...], *, find_known: bool = False
) -> tuple[ItemType, ...]:
    """The item types for which a find is offered: those with fewer known instances than some way of meeting the
    goal needs.

    Args:
        available: types that exist; empty if unknown.
        find_known: also offer finds of known types.
    """
    if not knowledge.unsearched:
        return ()
    return tuple(
        t
        for t, most in max_wants_by_type(goal).items()
        if (not available or t in available) and (find_known or _known(knowledge, t) < max(most, 1))
    )


@lru_cache(maxsize=256)
def max_wants_by_type(goal: Goal) -> Mapping[ItemType, int]:
    """For each relevant type, sorted: the largest number of wants that name it in one way of meeting the goal."""
    alternatives = goal_alternatives(goal)
    most = {
        t: max(sum(want.item_type == t for want in alternative) for alternative in alternatives)
        for t in relevant_types(goal)
    }
    return MappingProxyType(most)


def _known(knowledge: Knowledge, item_type: ItemType) -> int:
    """The number of known instances that the robot holds or can reach."""
    held = knowledge.holding is not None and knowledge.holding.type == item_type
    return sum(knowledge.travel.reaches(location) for location, _ in knowledge.where(item_type)) + held


def relevant_locations(goal: Goal, knowledge: Knowledge, hubs: tuple[LocationId, ...] = ()) -> tuple[LocationId, ...]:
    """The reachable ones among the robot's location, the goal's locations, the known locations of relevant items,
    and hubs.

    For goals without preparation no optimal plan needs another place where travel and find costs obey the triangle
    inequality: every item is carried straight from where it is to where it is wanted. For cooking, another meeting
    place may be better; hubs provide some.
    """
    types = relevant_types(goal)
    known = [location for t in types for location, _ in knowledge.where(t)]
    wanted = (knowledge.robot_at, *goal_locations(goal), *sorted(known), *hubs)
    return tuple(location for location in dict.fromkeys(wanted) if knowledge.travel.reaches(location))


def problem_of(
    goal: Goal,
    knowledge: Knowledge,
    costs: ActionCosts,
    *,
    locations: tuple[LocationId, ...],
    find_costs: FindCosts | None,
    every_item: bool = False,
) -> Problem:
    """The planning problem by the robot's knowledge; finds are offered for the types in find_costs.

    Args:
        every_item: with the known items of types that do not matter to the goal, too.
    """
    things: list[PlanningItem] = []
    found = find_costs.item_types if find_costs is not None else ()
    max_by_type = dict(max_wants_by_type(goal))
    if every_item:
        max_by_type |= {t: 0 for t in sorted(knowledge.known_types) if t not in max_by_type}
    for item_type, most in max_by_type.items():
        for location, item in knowledge.where(item_type):
            if knowledge.travel.reaches(location):
                things.append(PlanningItem(id=item.id, type=item_type, at=location))
        if item_type in found:
            lacking = max(most - _known(knowledge, item_type), 1)
            names = [f"{MISSING}{item_type}"] + [f"{MISSING}{item_type}#{i + 2}" for i in range(lacking - 1)]
            things += [PlanningItem(id=ItemId(name), type=item_type) for name in names]
    held = knowledge.holding
    if held is not None:
        things.append(PlanningItem(id=held.id, type=held.type, held=True))
    return Problem(
        travel=knowledge.travel,
        costs=costs,
        locations=locations,
        robot_at=knowledge.robot_at,
        things=tuple(sorted(things, key=lambda thing: thing.id)),
        facts=knowledge.facts,
        goal=goal,
        find_costs=find_costs,
    )


class GoalReach(MessageEnum):
    """Whether some way of meeting the goal has all its locations within reach."""

    REACHABLE = ""
    UNREACHABLE = "{places} cannot be reached"


def goal_reach(problem: Problem) -> Result[GoalReach]:
    """Whether a way of meeting the goal is within reach; if none is, the goal locations that cannot be reached."""
    for alternative in goal_alternatives(problem.goal):
        if all(problem.travel.reaches(want.at) for want in alternative):
            return GoalReach.REACHABLE.result()
    places = sorted({place for place in goal_locations(problem.goal) if not problem.travel.reaches(place)})
    return GoalReach.UNREACHABLE.result(places=", ".join(places))
