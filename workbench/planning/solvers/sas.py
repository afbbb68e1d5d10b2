"""Direct translation of a typed problem into SAS+, which takes milliseconds where a PDDL translator takes seconds.

The format is Fast Downward's translator output, version 3. Variables: the robot's location; what its hand holds;
where each item is (a location, the hand, or missing); one for each property that an item may gain; and whether the
goal has been closed. Costs are integers: hundredths of a cost unit.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from workbench.planning.actions import PREPARATIONS, Preparation
from workbench.planning.plans import PlanStep
from workbench.planning.problem import Problem
from workbench.planning.solvers.grounding import (
    GoalAssignment,
    endings,
    find_steps,
    move_steps,
    pick_and_place_steps,
    preparation_steps,
)
from workbench.planning.tasks import Holding
from workbench.worlds.house import ItemId, LocationId

COST_SCALE = 100
"""Integer cost of one cost unit."""

Pair = tuple[int, int]
"""A variable and a value."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SasTask:
    """The SAS+ text and the mapping to read a plan back.

    Attributes:
        text: the SAS+ file.
        steps: the plan step of each operator; None for closing actions.
    """

    text: str
    steps: dict[str, PlanStep | None]


@dataclass(slots=True)
class _Writer:
    """Collects variables and operators."""

    problem: Problem
    variables: list[tuple[str, list[str]]] = field(default_factory=list[tuple[str, list[str]]])
    operators: list[str] = field(default_factory=list[str])
    steps: dict[str, PlanStep | None] = field(default_factory=dict[str, "PlanStep | None"])
    where: dict[LocationId, int] = field(default_factory=dict[LocationId, int])
    thing: dict[ItemId, int] = field(default_factory=dict[ItemId, int])
    fact: dict[tuple[str, ItemId], int] = field(default_factory=dict[tuple[str, ItemId], int])
    initial: list[int] = field(default_factory=list[int])

    def variable(self, name: str, values: list[str], start: int) -> int:
        self.variables.append((name, values))
        self.initial.append(start)
        return len(self.variables) - 1

    def operator(self, step: PlanStep | None, prevail: list[Pair], effects: list[tuple[int, int, int]]) -> None:
        """Add an operator. `effects` are (variable, value before or -1, value after)."""
        name = f"o{len(self.operators)}"
        self.steps[name] = step
        lines = ["begin_operator", name, str(len(prevail)), *(f"{var} {value}" for var, value in prevail)]
        lines += [str(len(effects)), *(f"0 {var} {pre} {post}" for var, pre, post in effects)]
        lines += [str(scaled(step.cost) if step is not None else 0), "end_operator"]
        self.operators.append("\n".join(lines))


def scaled(cost: float) -> int:
    """A cost as the integer given to planners."""
    return round(cost * COST_SCALE)


ROBOT, HAND = 0, 1


def sas_of(problem: Problem) -> SasTask:
    """The problem translated into SAS+."""
    w = _Writer(problem)
    w.where = {location: i for i, location in enumerate(problem.locations)}
    _variables(w)
    places = len(problem.locations)
    for step in move_steps(problem):
        w.operator(step, [], [(ROBOT, w.where[step.origin], w.where[step.target])])
    for step in pick_and_place_steps(problem):
        at, number = w.where[step.origin], w.thing[step.items[0]]
        in_hand, holds = places, _hand_value(w, step.items[0])
        if step.action == "pick":
            w.operator(step, [(ROBOT, at)], [(HAND, 0, holds), (number, at, in_hand)])
        else:
            w.operator(step, [(ROBOT, at)], [(HAND, holds, 0), (number, in_hand, at)])
    for step in find_steps(problem):
        number, a, b = w.thing[step.items[0]], w.where[step.origin], w.where[step.target]
        effects = [(HAND, 0, _hand_value(w, step.items[0])), (number, places + 1, places)]
        if a == b:
            w.operator(step, [(ROBOT, a)], effects)
        else:
            w.operator(step, [], [(ROBOT, a, b), *effects])
    for preparation, step in preparation_steps(problem):
        _prepare(w, preparation, step)
    goal = w.variable("closed", ["no", "yes"], 0)
    for ending in endings(problem):
        conditions = _conditions(w, ending)
        if conditions is not None:
            w.operator(None, conditions, [(goal, 0, 1)])
    return SasTask(text=_text(w, goal), steps=w.steps)


def _variables(w: _Writer) -> None:
    problem = w.problem
    held = next((i for i, thing in enumerate(problem.things) if thing.held), None)
    places = [str(location) for location in problem.locations]
    w.variable("robot", places, w.where[problem.robot_at])
    w.variable("hand", ["free", *(thing.id for thing in problem.things)], 0 if held is None else held + 1)
    for thing in problem.things:
        if thing.held:
            start = len(places)
        else:
            start = w.where[thing.at] if thing.at is not None else len(places) + 1
        w.thing[thing.id] = w.variable(f"at {thing.id}", [*places, "in hand", "missing"], start)
    for preparation in PREPARATIONS:
        for part in preparation.parts:
            for thing in problem.things:
                for prop in part.gains:
                    if thing.type in part.types and (prop, thing.id) not in w.fact:
                        known = int((prop, (thing.id,)) in problem.facts)
                        w.fact[prop, thing.id] = w.variable(f"{prop} {thing.id}", ["no", "yes"], known)


def _hand_value(w: _Writer, item: ItemId) -> int:
    return next(i for i, thing in enumerate(w.problem.things) if thing.id == item) + 1


def _prepare(w: _Writer, preparation: Preparation, step: PlanStep) -> None:
    at = w.where[step.origin]
    prevail = [(ROBOT, at)]
    effects: list[tuple[int, int, int]] = []
    in_hand = [item for part, item in zip(preparation.parts, step.items, strict=True) if part.where == "hand"]
    prevail.append((HAND, _hand_value(w, in_hand[0]) if in_hand else 0))
    for part, item in zip(preparation.parts, step.items, strict=True):
        if part.where == "here":
            prevail.append((w.thing[item], at))
        prevail += [(w.fact[prop, item], 1) for prop in part.needs if prop not in part.gains]
        effects += [(w.fact[prop, item], -1, 1) for prop in part.gains]
    w.operator(step, prevail, effects)


def _conditions(w: _Writer, ending: GoalAssignment) -> list[Pair] | None:
    """The conditions of a closing action; None if they contradict each other."""
    prevail: list[Pair] = []
    for want, thing in zip(ending.wants, ending.things, strict=True):
        if isinstance(want, Holding):
            prevail += [(ROBOT, w.where[want.at]), (HAND, _hand_value(w, thing.id))]
            continue
        prevail.append((w.thing[thing.id], w.where[want.at]))
        for prop in want.properties:
            if (prop, thing.id) not in w.fact:
                return None
            prevail.append((w.fact[prop, thing.id], 1))
    consistent = len({var for var, _ in prevail}) == len(set(prevail))
    return list(dict.fromkeys(prevail)) if consistent else None


def _text(w: _Writer, goal: int) -> str:
    lines = ["begin_version", "3", "end_version", "begin_metric", "1", "end_metric", str(len(w.variables))]
    for i, (name, values) in enumerate(w.variables):
        plain = name.replace("\n", " ")
        lines += ["begin_variable", f"var{i}", "-1", str(len(values))]
        lines += [f"Atom {plain} {value}".replace("\n", " ") for value in values]
        lines.append("end_variable")
    lines += ["0", "begin_state", *(str(value) for value in w.initial), "end_state"]
    lines += ["begin_goal", "1", f"{goal} 1", "end_goal", str(len(w.operators)), *w.operators, "0"]
    return "\n".join(lines) + "\n"
