"""The task of a run as the attachment "task.json"."""

from __future__ import annotations

import msgspec

from workbench.errors import Malformed
from workbench.planning.tasks import Added, AllOf, AnyOf, Delivered, Goal, Holding, Task
from workbench.worlds.house import ItemType, LocationId

TASK_ATTACHMENT = "task.json"
MAX_DEPTH = 32
"""Deepest nesting of a goal; deeper ones are taken as a damaged file."""


class MalformedTask(Malformed):
    """The attachment task.json is invalid."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"{TASK_ATTACHMENT} is no task: {reason}. Run lios doctor on the log.")


class _Delivered(msgspec.Struct, frozen=True, kw_only=True, tag="delivered", tag_field="goal"):
    item_type: str
    at: str
    properties: tuple[str, ...] = ()


class _Holding(msgspec.Struct, frozen=True, kw_only=True, tag="holding", tag_field="goal"):
    item_type: str
    at: str


class _AllOf(msgspec.Struct, frozen=True, kw_only=True, tag="all-of", tag_field="goal"):
    parts: tuple[_Goal, ...]


class _AnyOf(msgspec.Struct, frozen=True, kw_only=True, tag="any-of", tag_field="goal"):
    parts: tuple[_Goal, ...]


_Goal = _Delivered | _Holding | _AllOf | _AnyOf


class _Added(msgspec.Struct, frozen=True, kw_only=True):
    item_type: str
    stands: tuple[str, ...]


class _Task(msgspec.Struct, frozen=True, kw_only=True):
    scenario: str
    goal: _Goal
    failure_cost: float
    budget_s: float
    title: str = ""
    available: tuple[str, ...] = ()
    added: tuple[_Added, ...] | msgspec.UnsetType = msgspec.UNSET
    """Omitted if nothing was added, as in logs older than this field."""


def task_to_json(task: Task) -> bytes:
    """The attachment; the same task gives the same bytes."""
    return msgspec.json.encode(
        _Task(
            scenario=task.scenario,
            goal=_wire(task.goal),
            failure_cost=task.failure_cost,
            budget_s=task.budget_s,
            title=task.title,
            available=task.available,
            added=tuple(_Added(item_type=a.item_type, stands=a.stands) for a in task.added) or msgspec.UNSET,
        )
    )


def task_from_json(data: bytes | str) -> Task:
    """Decode the attachment.

    Raises:
        MalformedTask: not JSON, or not a task.
    """
    try:
        wire = msgspec.json.decode(data, type=_Task)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise MalformedTask(str(error)) from error
    return Task(
        scenario=wire.scenario,
        goal=_domain(wire.goal, 0),
        failure_cost=wire.failure_cost,
        budget_s=wire.budget_s,
        title=wire.title,
        available=tuple(ItemType(name) for name in wire.available),
        added=tuple(Added(item_type=ItemType(a.item_type), stands=a.stands) for a in wire.added or ()),
    )


def _wire(goal: Goal) -> _Goal:
    match goal:
        case Delivered():
            return _Delivered(item_type=goal.item_type, at=goal.at, properties=goal.properties)
        case Holding():
            return _Holding(item_type=goal.item_type, at=goal.at)
        case AllOf():
            return _AllOf(parts=tuple(_wire(part) for part in goal.parts))
        case AnyOf():
            return _AnyOf(parts=tuple(_wire(part) for part in goal.parts))


def _domain(goal: _Goal, depth: int) -> Goal:
    if depth > MAX_DEPTH:
        raise MalformedTask(f"its goal is nested deeper than {MAX_DEPTH}")
    match goal:
        case _Delivered():
            return Delivered(item_type=ItemType(goal.item_type), at=LocationId(goal.at), properties=goal.properties)
        case _Holding():
            return Holding(item_type=ItemType(goal.item_type), at=LocationId(goal.at))
        case _AllOf():
            return AllOf(parts=tuple(_domain(part, depth + 1) for part in goal.parts))
        case _AnyOf():
            return AnyOf(parts=tuple(_domain(part, depth + 1) for part in goal.parts))
