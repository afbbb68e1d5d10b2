"""Tasks whose every name is a word of a planner's grammar, or that need a find back, are planned by every planner."""

from __future__ import annotations

import re

import numpy as np
import pytest
from problems import COSTS, find_back, grid_place

from workbench.planning.plans import PlanStatus
from workbench.planning.problem import Problem, problem_of
from workbench.planning.solvers.external import engines_here
from workbench.planning.solvers.pddl import pddl_of
from workbench.planning.solvers.registry import solver
from workbench.planning.solvers.reserved_words import RESERVED, RESERVED_WORDS
from workbench.planning.tasks import AllOf, Delivered
from workbench.worlds.house import Container, ContainerId, Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import knowledge_at_start
from workbench.worlds.travel import TravelCosts

WORDS = tuple(sorted(RESERVED))
PLACES = ("over", "end", "object", "number")


def task_of(words: tuple[str, ...]) -> Problem:
    """Mugs and books named after words, on two of four containers named after words; one of each is to be moved."""
    plan, travel = grid_place(np.array([(0, 0), (1, 0), (4, 0), (4, 3), (0, 5)]))
    shelves = tuple(
        Container(id=ContainerId(word), type=c.type, room=c.room, pose=c.pose, size_m=c.size_m)
        for word, c in zip(PLACES, plan.containers, strict=True)
    )
    plan = type(plan)(
        name=plan.name,
        rooms=plan.rooms,
        walls=(),
        doors=(),
        windows=(),
        containers=shelves,
        furniture=(),
        start=plan.start,
    )
    names = (travel.locations[0], *(LocationId(shelf.id) for shelf in shelves))
    knowledge = knowledge_at_start(plan, TravelCosts(locations=names, metres=travel.metres), {})
    for shelf, held, kind in ((shelves[0], words[::2], "Mug"), (shelves[1], words[1::2], "Book")):
        items = tuple(Item(id=ItemId(word), type=ItemType(kind)) for word in held)
        knowledge = knowledge.seen(shelf.id, items)
    goal = AllOf(
        parts=(
            Delivered(item_type=ItemType("Mug"), at=LocationId("number")),
            Delivered(item_type=ItemType("Book"), at=LocationId("object")),
        )
    )
    return problem_of(goal, knowledge, COSTS, locations=names, find_costs=None)


def test_no_printed_object_is_a_word_of_a_grammar() -> None:
    printed = pddl_of(task_of(WORDS))
    assert {"start", "end", "unknown", "oneof", "within", "process"} <= RESERVED
    assert not set(printed.names) & RESERVED
    assert all(re.fullmatch(r"[a-z][a-z0-9_]*", name) for name in printed.names)
    assert set(WORDS) <= set(printed.names.values())
    assert len(printed.names) == len(WORDS) + len(PLACES) + 1, "items named as places are objects of their own"


@pytest.mark.parametrize("name", ["pddl-blind", "pddl-ff-astar2"])
def test_a_task_of_reserved_words_is_planned(name: str) -> None:
    problem = task_of(WORDS[:: len(WORDS) // 8])
    best = solver("sas-blind").solve(problem, budget_s=30).plan
    made = solver(name).solve(problem, budget_s=60).plan
    assert made.status is PlanStatus.SOLVED, made.note
    assert made.cost >= best.cost - 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("grammar", RESERVED_WORDS)
def test_every_engine_plans_a_task_of_reserved_words(grammar: str) -> None:
    problem = task_of(tuple(sorted(RESERVED_WORDS[grammar])))
    for engine in engines_here() or ():
        made = solver(f"up-{engine}").solve(problem, budget_s=60).plan
        assert made.status is PlanStatus.SOLVED, (engine, made.note)


@pytest.mark.slow
def test_every_engine_plans_where_only_a_find_back_helps() -> None:
    """One place is known, and what is missing is to be brought there."""
    for engine in engines_here() or ():
        made = solver(f"up-{engine}").solve(find_back(), budget_s=60).plan
        assert made.status is PlanStatus.SOLVED, (engine, made.note)
        assert made.cost == pytest.approx(8 + COSTS.manipulation)


def test_no_ground_action_deletes_what_it_adds() -> None:
    """A find that ends where it began is an action of its own: what an action deletes and adds is not true to all."""
    printed = pddl_of(find_back())
    finds = [name.split() for name, step in printed.steps.items() if step is not None and step.action == "find"]
    assert [words[0] for words in finds] == ["find-here"]
    assert all(len(set(words)) == len(words) for words in map(str.split, printed.steps))
