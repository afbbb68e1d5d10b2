"""A check, by counts of item types including preparations, whether a house can support a goal at all.

It does not prove that a plan exists.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from workbench.planning.actions import producers
from workbench.planning.problem import goal_alternatives
from workbench.planning.tasks import Delivered, Goal, Holding
from workbench.worlds.house import ItemType
from workbench.worlds.names import readable_name


def missing_support(goal: Goal, things: Mapping[ItemType, int]) -> str:
    """What the first way of meeting the goal lacks, if every way lacks something; otherwise "".

    A contradictory way (two items in one hand) lacks nothing: proving that no plan exists is left to the planner.

    Args:
        things: number of items of each type.
    """
    first = ""
    for way in goal_alternatives(goal):
        lacks = _missing_in_alternative(way, things)
        if not lacks:
            return ""
        first = first or lacks
    return first


def _missing_in_alternative(way: tuple[Delivered | Holding, ...], things: Mapping[ItemType, int]) -> str:
    contradicts = sum(isinstance(want, Holding) for want in way) > 1
    wanted = Counter(want.item_type for want in way)
    for item_type, number in wanted.items():
        have = things.get(item_type, 0)
        if not have:
            return f"no {readable_name(item_type)}"
        if have < number and not contradicts:
            return f"{have} {readable_name(item_type)}, and the goal asks for {number}"
    for want in way:
        for prop in getattr(want, "properties", ()):
            if not _can_provide(want.item_type, prop, things):
                return f"nothing that makes a {readable_name(want.item_type)} {prop}"
    return ""


def _can_provide(item_type: ItemType, prop: str, things: Mapping[ItemType, int]) -> bool:
    """Whether some preparation gives the property, with an available type for each of its parts."""
    return any(
        all(
            any(things.get(t) and all(_can_provide(t, need, things) for need in part.needs) for t in part.types)
            for i, part in enumerate(preparation.parts)
            if i != index
        )
        and all(_can_provide(item_type, need, things) for need in preparation.parts[index].needs)
        for preparation, index in producers(item_type, prop)
    )
