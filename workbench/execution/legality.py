"""The check whether a step can be executed, so that an illegal plan becomes a status of the run."""

from __future__ import annotations

from workbench.message_enum import MessageEnum, Result
from workbench.planning.actions import ACTION_NAMES
from workbench.planning.plans import PlanStep
from workbench.planning.strategy import Decision
from workbench.worlds.house import ItemId
from workbench.worlds.knowledge import Knowledge


class Legality(MessageEnum):
    """Whether a step can be executed, and if not, why."""

    LEGAL = ""
    UNKNOWN_ACTION = "there is no action {action}"
    ROBOT_ELSEWHERE = "it starts at {origin}, but the robot is at {robot_at}"
    UNREACHABLE = "{target} cannot be reached"
    HAND_FULL = "the hand holds {held}"
    NO_CONTAINER = "the search policy names no container"
    NO_ITEM = "it names no item"
    NOT_THERE = "{item} is not known to be at {robot_at}"
    NOT_HELD = "the robot does not hold {item}"
    NOT_AT_HAND = "{item} is not at hand"


def legality(step: PlanStep, knowledge: Knowledge, made: Decision) -> Result[Legality]:
    """Whether a step of a decision can be executed in this state."""
    if step.action not in ACTION_NAMES:
        return Legality.UNKNOWN_ACTION.result(action=repr(step.action))
    if step.origin != knowledge.robot_at:
        return Legality.ROBOT_ELSEWHERE.result(origin=step.origin, robot_at=knowledge.robot_at)
    if not knowledge.travel.reaches(step.target):
        return Legality.UNREACHABLE.result(target=step.target)
    if step.action == "find":
        return _legality_of_find(knowledge, made)
    if step.action == "move":
        return Legality.LEGAL.result()
    if not step.items:
        return Legality.NO_ITEM.result()
    if step.action == "pick":
        return _legality_of_pick(step.items[0], knowledge)
    held = knowledge.holding.id if knowledge.holding else None
    if step.action == "place":
        legal = held == step.items[0]
        return Legality.LEGAL.result() if legal else Legality.NOT_HELD.result(item=step.items[0])
    at_hand = {item.id for item in knowledge.items_at.get(knowledge.robot_at, ())} | {held}
    missing = [item for item in step.items if item not in at_hand]
    return Legality.NOT_AT_HAND.result(item=missing[0]) if missing else Legality.LEGAL.result()


def _legality_of_find(knowledge: Knowledge, made: Decision) -> Result[Legality]:
    if knowledge.holding is not None:
        return Legality.HAND_FULL.result(held=knowledge.holding.id)
    return Legality.LEGAL.result() if made.search_order else Legality.NO_CONTAINER.result()


def _legality_of_pick(item: ItemId, knowledge: Knowledge) -> Result[Legality]:
    if knowledge.holding is not None:
        return Legality.HAND_FULL.result(held=knowledge.holding.id)
    if any(item == there.id for there in knowledge.items_at.get(knowledge.robot_at, ())):
        return Legality.LEGAL.result()
    return Legality.NOT_THERE.result(item=item, robot_at=knowledge.robot_at)
