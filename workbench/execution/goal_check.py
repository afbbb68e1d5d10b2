"""Is the goal met? Judged from what the robot knows, apart from any planner."""

from __future__ import annotations

from itertools import chain

from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding
from workbench.worlds.house import Item, ItemId
from workbench.worlds.knowledge import Knowledge


def is_met(goal: Goal, knowledge: Knowledge) -> bool:
    """Whether the goal holds; parts of an AllOf are met by instances of their own."""
    if isinstance(goal, Delivered | Holding):
        return bool(_candidates(goal, knowledge))
    return _met_by(goal, knowledge, frozenset()) is not None


def _met_by(goal: Goal, knowledge: Knowledge, used: frozenset[ItemId]) -> frozenset[ItemId] | None:
    """The items used after meeting the goal with items that are not used yet, or None."""
    if isinstance(goal, AllOf):
        if any(isinstance(part, Delivered) and not _candidates(part, knowledge) for part in goal.parts):
            return None
        return _all_met(goal.parts, knowledge, used)
    if isinstance(goal, AnyOf):
        answers = (_met_by(part, knowledge, used) for part in goal.parts)
        return next((answer for answer in answers if answer is not None), None)
    candidates = (item for item in _candidates(goal, knowledge) if item.id not in used)
    first = next(candidates, None)
    return None if first is None else used | {first.id}


def _all_met(parts: tuple[Goal, ...], knowledge: Knowledge, used: frozenset[ItemId]) -> frozenset[ItemId] | None:
    if not parts:
        return used
    head, rest = parts[0], parts[1:]
    for choice in _ways(head, knowledge, used):
        done = _all_met(rest, knowledge, choice)
        if done is not None:
            return done
    return None


def _ways(goal: Goal, knowledge: Knowledge, used: frozenset[ItemId]) -> tuple[frozenset[ItemId], ...]:
    """All ways of meeting one part, as the items used afterwards."""
    if isinstance(goal, AnyOf):
        return tuple(chain.from_iterable(_ways(part, knowledge, used) for part in goal.parts))
    if isinstance(goal, AllOf):
        ways = (used,)
        for part in goal.parts:
            ways = tuple(chain.from_iterable(_ways(part, knowledge, way) for way in ways))
        return ways
    return tuple(used | {item.id} for item in _candidates(goal, knowledge) if item.id not in used)


def _candidates(goal: Delivered | Holding, knowledge: Knowledge) -> tuple[Item, ...]:
    if isinstance(goal, Holding):
        held = knowledge.holding
        there = knowledge.robot_at == goal.at and held is not None and held.type == goal.item_type
        return (held,) if there and held is not None else ()
    there = tuple([item for item in knowledge.items_at.get(goal.at, ()) if item.type == goal.item_type])
    if not goal.properties:
        return there
    return tuple(i for i in there if all((prop, (i.id,)) in knowledge.facts for prop in goal.properties))
