"""Plans written out from the moves of the compiled search."""

from __future__ import annotations

from dataclasses import replace

from workbench.arrays import Ints
from workbench.planning.builtin.attempts import Attempt
from workbench.planning.builtin.recipe_arrays import place_of
from workbench.planning.builtin.search_interface import CARRY, CHOOSE, FETCH, PLACE
from workbench.planning.plans import Plan, PlanStep
from workbench.planning.problem import MISSING, PlanningItem, Problem
from workbench.search.ties import first_of_least
from workbench.worlds.house import LocationId


def steps_of(problem: Problem, attempt: Attempt, moves: Ints) -> tuple[PlanStep, ...]:
    """The errands found by the search (in reverse order) as steps of a plan."""
    return _PlanWriter(problem, attempt).steps(moves)


class _PlanWriter:
    """Expands errands into plan steps while tracking the state."""

    def __init__(self, problem: Problem, attempt: Attempt) -> None:
        self.problem, self.attempt = problem, attempt
        self.things = {thing.id: thing for thing in problem.things}
        self.index = {location: i for i, location in enumerate(problem.locations)}
        self.robot = problem.robot_at
        self.chosen: dict[int, PlanningItem] = {}
        self.at: dict[int, LocationId] = {}
        self.out: list[PlanStep] = []

    def steps(self, moves: Ints) -> tuple[PlanStep, ...]:
        held = next((thing for thing in self.problem.things if thing.held), None)
        if held is not None and self.attempt.put_down:
            self.handle("place", held)
        if held is not None and self.attempt.hand >= 0:
            self.chosen[self.attempt.hand] = held
        for kind, x, b in moves[::-1].tolist():
            self.follow(kind, x, self.problem.locations[b])
        return tuple(self.out)

    def follow(self, kind: int, x: int, b: LocationId) -> None:
        if kind == CHOOSE:
            fitting = [t for t in self.fitting(x) if place_of(self.problem, t) == b]
            self.chosen[x], self.at[x] = fitting[0], b
        elif kind == FETCH:
            self.fetch(x, b)
        elif kind == CARRY:
            self.walk(b)
        elif kind == PLACE:
            self.handle("place", self.chosen[x])
            self.at[x] = self.robot
        else:
            self.prepare(x, b)

    def fitting(self, slot: int) -> list[PlanningItem]:
        return [self.things[name] for name in self.attempt.recipe.slots[slot].things]

    def fetch(self, slot: int, b: LocationId) -> None:
        if slot not in self.chosen:
            i, j = self.index[self.robot], self.index[b]
            fitting = sorted(self.fitting(slot), key=lambda t: t.id)
            thing = first_of_least(fitting, lambda t: _fetch_cost(self.problem, t, self.attempt, i, j))
            self.chosen[slot] = thing
            if thing.missing:
                self.find(thing, i, j)
                return
            self.at[slot] = self.problem.robot_at if thing.at is None else thing.at
        self.walk(self.at[slot])
        self.handle("pick", self.chosen[slot])
        self.walk(b)

    def find(self, thing: PlanningItem, i: int, j: int) -> None:
        """The find, and the walks before and after it, between two locations by their numbers."""
        locations, costs, routes = self.problem.locations, self.problem.find_costs, self.attempt.routes
        assert costs is not None, "what is missing is offered with its find costs"
        item = costs.item_types.index(thing.type)
        begin, end = locations[routes.begin[item, i, j]], locations[routes.end[item, i, j]]
        self.walk(begin)
        self.step("find", end, thing, costs.of(thing.type, begin, end))
        self.walk(locations[j])

    def prepare(self, number: int, b: LocationId) -> None:
        self.walk(b)
        operation = self.attempt.recipe.operations[number]
        things = [self.chosen[slot] for slot in operation.slots]
        self.out.append(
            PlanStep(
                action=operation.preparation.name,
                origin=self.robot,
                target=self.robot,
                item_types=tuple(thing.type for thing in things),
                items=tuple(thing.id for thing in things),
                cost=self.problem.costs.manipulation,
            )
        )

    def handle(self, action: str, thing: PlanningItem) -> None:
        self.step(action, self.robot, thing, self.problem.costs.manipulation)

    def walk(self, b: LocationId) -> None:
        if b != self.robot:
            metres = self.attempt.arrays.d[self.index[self.robot], self.index[b]]
            self.step("move", b, None, float(metres))

    def step(self, action: str, target: LocationId, thing: PlanningItem | None, cost: float) -> None:
        self.out.append(
            PlanStep(
                action=action,
                origin=self.robot,
                target=target,
                item_types=(thing.type,) if thing else (),
                items=(thing.id,) if thing else (),
                cost=cost,
            )
        )
        self.robot = target


def _fetch_cost(problem: Problem, thing: PlanningItem, attempt: Attempt, i: int, j: int) -> float:
    """One entry of a thing's own table of errands, by the numbers of two locations."""
    at, costs = place_of(problem, thing), problem.find_costs
    if at is None:
        return float(attempt.routes.metres[costs.item_types.index(thing.type), i, j]) if costs else float("inf")
    k = problem.locations.index(at)
    return float(attempt.arrays.d[i, k] + problem.costs.manipulation + attempt.arrays.d[k, j])


def without_hypothetical(plan: Plan) -> Plan:
    """The plan without the ids of hypothetical items: of an item that has not been found, only the type is known."""
    if not any(step.action == "find" for step in plan.steps):
        return plan
    return replace(plan, steps=tuple([_without_hypothetical(step) for step in plan.steps]))


def _without_hypothetical(step: PlanStep) -> PlanStep:
    if not any(item.startswith(MISSING) for item in step.items):
        return step
    return PlanStep(
        action=step.action, origin=step.origin, target=step.target, item_types=step.item_types, cost=step.cost
    )
