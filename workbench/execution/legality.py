"""The check whether a step can be executed, so that an illegal plan becomes a status of the run."""

from __future__ import annotations

from workbench.planning.actions import ACTION_NAMES
from workbench.planning.plans import PlanStep
from workbench.planning.strategy import Decision
from workbench.worlds.knowledge import Knowledge


def illegality_reason(step: PlanStep, knowledge: Knowledge, made: Decision) -> str | None:
    """Why a step cannot be executed in this state, or None when it can."""
    if step.action not in ACTION_NAMES:
        return f"there is no action {step.action!r}"
    if step.origin != knowledge.robot_at:
        return f"it starts at {step.origin}, but the robot is at {knowledge.robot_at}"
    if not knowledge.travel.reaches(step.target):
        return f"{step.target} cannot be reached"
    if step.action == "find":
        return _why_no_find(knowledge, made)
    if step.action == "move":
        return None
    if not step.items:
        return "it names no item"
    if step.action == "pick":
        return _why_no_pick(step, knowledge)
    held = knowledge.holding.id if knowledge.holding else None
    if step.action == "place":
        return None if held == step.items[0] else f"the robot does not hold {step.items[0]}"
    at_hand = {item.id for item in knowledge.items_at.get(knowledge.robot_at, ())} | {held}
    missing = [item for item in step.items if item not in at_hand]
    return f"{missing[0]} is not at hand" if missing else None


def _why_no_find(knowledge: Knowledge, made: Decision) -> str | None:
    if knowledge.holding is not None:
        return f"the hand holds {knowledge.holding.id}"
    if not made.search_order:
        return "the search policy names no container"
    return None


def _why_no_pick(step: PlanStep, knowledge: Knowledge) -> str | None:
    if knowledge.holding is not None:
        return f"the hand holds {knowledge.holding.id}"
    here = {item.id for item in knowledge.items_at.get(knowledge.robot_at, ())}
    return None if step.items[0] in here else f"{step.items[0]} is not known to be at {knowledge.robot_at}"
