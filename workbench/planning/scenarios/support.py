"""A check, by counts of item types including preparations, whether a house can support a goal at all.

It does not prove that a plan exists.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from workbench.message_enum import MessageEnum, Result
from workbench.planning.actions import producers
from workbench.planning.problem import goal_alternatives
from workbench.planning.tasks import Delivered, Goal, Holding
from workbench.worlds.house import ItemType
from workbench.worlds.names import readable_name


class Support(MessageEnum):
    """Whether the items of a house can meet a goal, and if not, what is lacking."""

    COMPLETE = ""
    NO_ITEM = "no {item_type}"
    TOO_FEW = "{have} {item_type}, and the goal asks for {wanted}"
    NO_PREPARATION = "nothing that makes a {item_type} {prop}"


def support(goal: Goal, things: Mapping[ItemType, int]) -> Result[Support]:
    """What the first way of meeting the goal lacks, if every way lacks something; otherwise COMPLETE.

    A contradictory way (two items in one hand) lacks nothing: proving that no plan exists is left to the planner.

    Args:
        things: number of items of each type.
    """
    first: Result[Support] | None = None
    for alternative in goal_alternatives(goal):
        found = _support_of_alternative(alternative, things)
        if found.kind is Support.COMPLETE:
            return found
        first = first or found
    return first or Support.COMPLETE.result()


def _support_of_alternative(
    alternative: tuple[Delivered | Holding, ...], things: Mapping[ItemType, int]
) -> Result[Support]:
    contradicts = sum(isinstance(want, Holding) for want in alternative) > 1
    wanted = Counter(want.item_type for want in alternative)
    for item_type, number in wanted.items():
        have = things.get(item_type, 0)
        if not have:
            return Support.NO_ITEM.result(item_type=readable_name(item_type))
        if have < number and not contradicts:
            return Support.TOO_FEW.result(have=str(have), item_type=readable_name(item_type), wanted=str(number))
    for want in alternative:
        for prop in getattr(want, "properties", ()):
            if not _can_provide(want.item_type, prop, things):
                return Support.NO_PREPARATION.result(item_type=readable_name(want.item_type), prop=prop)
    return Support.COMPLETE.result()


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
