"""Translation of a typed problem into PDDL, with a mapping back from PDDL names to ours.

The PDDL is STRIPS with types and action costs, which every classical planner reads; it is always generated in full.
The goal's alternatives are closing actions `finish-1`, `finish-2`, ... that cost nothing, one for each assignment
of things to a way of meeting the goal. Costs are integers: hundredths of a cost unit.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from workbench.planning.actions import PREPARATIONS, Preparation
from workbench.planning.plans import PlanStep
from workbench.planning.problem import Problem
from workbench.planning.solvers.grounding import (
    FINISH,
    endings,
    find_steps,
    move_steps,
    pick_and_place_steps,
    preparation_steps,
)
from workbench.planning.solvers.reserved_words import RESERVED
from workbench.planning.solvers.sas import scaled
from workbench.planning.tasks import Holding


@dataclass(frozen=True, slots=True, kw_only=True)
class PddlTask:
    """The domain and problem files and the mappings to read a plan back.

    Attributes:
        domain, problem: text of the files.
        names: the original name of each PDDL name, of places and items.
        steps: the plan step of each ground action ("pick mug_1 sink_2"); None for closing actions.
    """

    domain: str
    problem: str
    names: dict[str, str]
    steps: dict[str, PlanStep | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Names:
    """PDDL names by our own. An item may be named as a place is, in PDDL no two objects may be."""

    places: dict[str, str]
    items: dict[str, str]


def pddl_of(problem: Problem) -> PddlTask:
    """The problem translated into PDDL."""
    places = pddl_names(problem.locations)
    items = pddl_names((thing.id for thing in problem.things), taken=places.values())
    names = _Names(places=places, items=items)
    steps: dict[str, PlanStep | None] = {}
    for step in (*move_steps(problem), *pick_and_place_steps(problem), *find_steps(problem)):
        ends = (step.origin, step.target) if step.origin != step.target else (step.origin,)
        action = _FIND_HERE if step.action == "find" and len(ends) == 1 else step.action
        steps[" ".join([action, *_called(names, step), *(places[end] for end in ends)])] = step
    for _, step in preparation_steps(problem):
        steps[" ".join([step.action, *_called(names, step), places[step.origin]])] = step
    closing = _closing_actions(problem, names)
    steps |= {f"{FINISH}-{i + 1}": None for i in range(len(closing))}
    return PddlTask(
        domain=_domain(problem, closing, names),
        problem=_problem(problem, names),
        names={pddl: ours for known in (places, items) for ours, pddl in known.items()},
        steps=steps,
    )


def _called(names: _Names, step: PlanStep) -> list[str]:
    return [names.items[item] for item in step.items]


def pddl_names(ours: Iterable[str], *, taken: Iterable[str] = ()) -> dict[str, str]:
    """A unique valid PDDL name for each name: lower case, starting with a letter, no reserved word of a
    planner (reserved_words.py) and none of those taken.

    "Mug|surface|2|40" becomes "mug_surface_2_40"; colliding names get a numeric suffix.
    """
    names: dict[str, str] = {}
    used = {*RESERVED, *(preparation.name for preparation in PREPARATIONS), *taken}
    for name in ours:
        plain = re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_") or "x"
        if not plain[0].isalpha():
            plain = f"x_{plain}"
        candidate, number = plain, 2
        while candidate in used:
            candidate, number = f"{plain}_{number}", number + 1
        used.add(candidate)
        names[name] = candidate
    return names


def _domain(problem: Problem, closing: list[str], names: _Names) -> str:
    roles = [f"({_role(p, i)} ?o - item)" for p in PREPARATIONS for i in range(len(p.parts))]
    properties = sorted({prop for p in PREPARATIONS for part in p.parts for prop in part.gains})
    manipulation = scaled(problem.costs.manipulation)
    constants = [*(f"{names.places[loc]} - location" for loc in problem.locations)]
    constants += [f"{names.items[thing.id]} - item" for thing in problem.things]
    return "\n".join(
        [
            "(define (domain missing-objects)",
            "(:requirements :strips :typing :action-costs)",
            "(:types location item - object)",
            "(:constants " + "\n  ".join(constants) + ")",
            "(:predicates (rob-at ?l - location) (hand-is-free) (holding ?o - item)",
            "  (is-at ?o - item ?l - location) (missing ?o - item) (done)",
            "  " + " ".join(f"({prop} ?o - item)" for prop in properties),
            "  " + " ".join(roles) + ")",
            "(:functions (total-cost) - number (move-cost ?a ?b - location) - number",
            "  (find-cost ?o - item ?a ?b - location) - number",
            f"  ({_FIND_HERE}-cost ?o - item ?a - location) - number)",
            _MOVE,
            _PICK.format(cost=manipulation),
            _PLACE.format(cost=manipulation),
            _FIND,
            _FINDING_HERE,
            *(_preparation(p, manipulation) for p in PREPARATIONS),
            *closing,
            ")",
            "",
        ]
    )


_MOVE = """(:action move :parameters (?a ?b - location)
 :precondition (rob-at ?a)
 :effect (and (not (rob-at ?a)) (rob-at ?b) (increase (total-cost) (move-cost ?a ?b))))"""
_PICK = """(:action pick :parameters (?o - item ?l - location)
 :precondition (and (rob-at ?l) (is-at ?o ?l) (hand-is-free))
 :effect (and (not (is-at ?o ?l)) (not (hand-is-free)) (holding ?o) (increase (total-cost) {cost})))"""
_PLACE = """(:action place :parameters (?o - item ?l - location)
 :precondition (and (rob-at ?l) (holding ?o))
 :effect (and (not (holding ?o)) (hand-is-free) (is-at ?o ?l) (increase (total-cost) {cost})))"""
_FIND = """(:action find :parameters (?o - item ?a ?b - location)
 :precondition (and (rob-at ?a) (hand-is-free) (missing ?o))
 :effect (and (not (rob-at ?a)) (rob-at ?b) (not (hand-is-free)) (not (missing ?o)) (holding ?o)
   (increase (total-cost) (find-cost ?o ?a ?b))))"""
_FIND_HERE = "find-here"
"""A find that ends where it began, as a separate action: `find` would both delete and add (rob-at ?a). By PDDL the
robot then is there; ENHSP takes it to be nowhere."""
_FINDING_HERE = f"""(:action {_FIND_HERE} :parameters (?o - item ?a - location)
 :precondition (and (rob-at ?a) (hand-is-free) (missing ?o))
 :effect (and (not (hand-is-free)) (not (missing ?o)) (holding ?o)
   (increase (total-cost) ({_FIND_HERE}-cost ?o ?a))))"""


def _role(preparation: Preparation, index: int) -> str:
    return f"{preparation.name}-{preparation.parts[index].role}"


def _preparation(preparation: Preparation, cost: int) -> str:
    variables = [f"?{part.role}" for part in preparation.parts]
    before = ["(rob-at ?l)"]
    after = [f"(increase (total-cost) {cost})"]
    for i, part in enumerate(preparation.parts):
        before.append(f"({_role(preparation, i)} {variables[i]})")
        before.append(f"(holding {variables[i]})" if part.where == "hand" else f"(is-at {variables[i]} ?l)")
        before += [f"({prop} {variables[i]})" for prop in part.needs]
        after += [f"({prop} {variables[i]})" for prop in part.gains]
    if all(part.where == "here" for part in preparation.parts):
        before.append("(hand-is-free)")
    return (
        f"(:action {preparation.name} :parameters ({' '.join(variables)} - item ?l - location)\n"
        f" :precondition (and {' '.join(before)})\n :effect (and {' '.join(after)}))"
    )


def _closing_actions(problem: Problem, names: _Names) -> list[str]:
    written: list[str] = []
    for ending in endings(problem):
        conditions: list[str] = []
        for want, thing in zip(ending.wants, ending.things, strict=True):
            item, at = names.items[thing.id], names.places[want.at]
            if isinstance(want, Holding):
                conditions += [f"(holding {item})", f"(rob-at {at})"]
            else:
                conditions.append(f"(is-at {item} {at})")
                conditions += [f"({prop} {item})" for prop in want.properties if _known_property(prop)]
                if not all(_known_property(prop) for prop in want.properties):
                    conditions = ["(done)"]
                    break
        written.append(
            f"(:action {FINISH}-{len(written) + 1} :parameters ()\n :precondition (and {' '.join(conditions)})\n"
            " :effect (and (done) (increase (total-cost) 0)))"
        )
    return written


def _known_property(prop: str) -> bool:
    return any(prop in part.gains for p in PREPARATIONS for part in p.parts)


def _problem(problem: Problem, names: _Names) -> str:
    facts = ["(= (total-cost) 0)", f"(rob-at {names.places[problem.robot_at]})"]
    if not any(thing.held for thing in problem.things):
        facts.append("(hand-is-free)")
    for thing in problem.things:
        item = names.items[thing.id]
        if thing.held:
            facts.append(f"(holding {item})")
        else:
            facts.append(f"(is-at {item} {names.places[thing.at]})" if thing.at is not None else f"(missing {item})")
        facts += [
            f"({_role(p, i)} {item})" for p in PREPARATIONS for i, r in enumerate(p.parts) if thing.type in r.types
        ]
    known = {thing.id for thing in problem.things}
    for prop, items in sorted(problem.facts):
        if items[0] in known and _known_property(prop):
            facts.append(f"({prop} {names.items[items[0]]})")
    for step in move_steps(problem):
        facts.append(f"(= (move-cost {names.places[step.origin]} {names.places[step.target]}) {scaled(step.cost)})")
    for step in find_steps(problem):
        where = f"{names.items[step.items[0]]} {names.places[step.origin]}"
        if step.origin == step.target:
            facts.append(f"(= ({_FIND_HERE}-cost {where}) {scaled(step.cost)})")
        else:
            facts.append(f"(= (find-cost {where} {names.places[step.target]}) {scaled(step.cost)})")
    listed = "\n  ".join(facts)
    return (
        "(define (problem task) (:domain missing-objects)\n"
        f"(:init {listed})\n(:goal (done))\n(:metric minimize (total-cost)))\n"
    )
