"""The check whether the robot's knowledge meets a goal, independent of any planner."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, product

from workbench.planning.matching import has_perfect_matching
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding
from workbench.worlds.house import Item, ItemId
from workbench.worlds.knowledge import Knowledge


def is_met(goal: Goal, knowledge: Knowledge) -> bool:
    """Whether the goal holds; parts of an AllOf need different instances."""
    if isinstance(goal, Delivered) and not goal.properties:  # nearly always; it is asked 20 times for each decision
        known = knowledge.where(goal.item_type)  # most are not found yet
        return bool(known) and goal.at in [place for place, _ in known]
    if isinstance(goal, Delivered | Holding):
        return bool(_candidates(goal, knowledge))
    return any(has_perfect_matching(alternative) for alternative in _alternatives(goal, knowledge))


def _alternatives(goal: Goal, knowledge: Knowledge) -> Iterator[tuple[tuple[ItemId, ...], ...]]:
    """All ways of meeting a goal, as the candidate items of each want; ways with an unmet want are left out."""
    if isinstance(goal, AnyOf):
        for part in goal.parts:
            yield from _alternatives(part, knowledge)
    elif isinstance(goal, AllOf):
        if any(isinstance(part, Delivered) and not is_met(part, knowledge) for part in goal.parts):
            return
        for alternatives in product(*(tuple(_alternatives(part, knowledge)) for part in goal.parts)):
            yield tuple(chain.from_iterable(alternatives))
    elif found := _candidates(goal, knowledge):
        yield (tuple([item.id for item in found]),)


def _candidates(goal: Delivered | Holding, knowledge: Knowledge) -> tuple[Item, ...]:
    if isinstance(goal, Holding):
        held = knowledge.holding
        there = knowledge.robot_at == goal.at and held is not None and held.type == goal.item_type
        return (held,) if there and held is not None else ()
    there = tuple([item for item in knowledge.items_at.get(goal.at, ()) if item.type == goal.item_type])
    if not goal.properties:
        return there
    return tuple(i for i in there if all((prop, (i.id,)) in knowledge.facts for prop in goal.properties))
