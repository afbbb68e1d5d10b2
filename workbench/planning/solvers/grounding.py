"""The ground actions of a problem, from which SAS+ is written and plans are read back.

Every step is a PlanStep whose preconditions and effects are those of problem.apply; tests replay plans of every
solver through apply. The goal's alternatives are closing actions that cost nothing: one for each assignment of
things to a way of meeting the goal.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

from workbench.planning.actions import PREPARATIONS, Preparation
from workbench.planning.plans import PlanStep
from workbench.planning.problem import PlanningItem, Problem, goal_alternatives
from workbench.planning.tasks import Delivered, Holding
from workbench.worlds.house import LocationId

FINISH = "finish"


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalAssignment:
    """One way of meeting the goal with particular items: the condition on each of them."""

    wants: tuple[Delivered | Holding, ...]
    things: tuple[PlanningItem, ...]


def preparation_bindings(problem: Problem) -> tuple[tuple[Preparation, tuple[PlanningItem, ...]], ...]:
    """Every preparation with every assignment of different items to its parts."""
    found: list[tuple[Preparation, tuple[PlanningItem, ...]]] = []
    for preparation in PREPARATIONS:
        fitting = [[t for t in problem.things if t.type in part.types] for part in preparation.parts]
        found += [(preparation, cast) for cast in product(*fitting) if len({t.id for t in cast}) == len(cast)]
    return tuple(found)


def endings(problem: Problem) -> tuple[GoalAssignment, ...]:
    """Every way of meeting the goal with every assignment of different items."""
    found: list[GoalAssignment] = []
    for alternative in goal_alternatives(problem.goal):
        if any(want.at not in problem.locations for want in alternative):
            continue
        fitting = [problem.of_type(want.item_type) for want in alternative]
        for cast in product(*fitting):
            if len({thing.id for thing in cast}) == len(cast):
                found.append(GoalAssignment(wants=alternative, things=cast))
    return tuple(found)


def move_steps(problem: Problem) -> Iterator[PlanStep]:
    """All moves between two different locations."""
    for a in problem.locations:
        for b in problem.locations:
            if a != b:
                yield PlanStep(action="move", origin=a, target=b, cost=problem.distance(a, b))


def pick_and_place_steps(problem: Problem) -> Iterator[PlanStep]:
    """All picks and places of every item at every location."""
    for thing in problem.things:
        for at in problem.locations:
            for action in ("pick", "place"):
                yield _on_the_spot(action, (thing,), at, problem)


def find_steps(problem: Problem) -> Iterator[PlanStep]:
    """All finds of every missing item, for every origin and target."""
    costs = problem.find_costs
    if costs is None:
        return
    for thing in problem.things:
        if not thing.missing:
            continue
        for a in problem.locations:
            for b in problem.locations:
                yield PlanStep(
                    action="find",
                    origin=a,
                    target=b,
                    item_types=(thing.type,),
                    items=(thing.id,),
                    cost=costs.of(thing.type, a, b),
                )


def preparation_steps(problem: Problem) -> Iterator[tuple[Preparation, PlanStep]]:
    """All preparations with every assignment of items, at every location."""
    for preparation, things in preparation_bindings(problem):
        for at in problem.locations:
            yield preparation, _on_the_spot(preparation.name, things, at, problem)


def _on_the_spot(action: str, things: tuple[PlanningItem, ...], at: LocationId, problem: Problem) -> PlanStep:
    return PlanStep(
        action=action,
        origin=at,
        target=at,
        item_types=tuple(thing.type for thing in things),
        items=tuple(thing.id for thing in things),
        cost=problem.costs.manipulation,
    )
