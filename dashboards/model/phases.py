"""Phases of a run: moving, searching, manipulating, planning, waiting."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from dashboards.model.labels import action_words, humanize_ids
from workbench.log_schema.events import ActionFinished

Kind = Literal["moving", "searching", "manipulating"]
KINDS: tuple[Kind, ...] = get_args(Kind)
"""Kinds of action, each a phase; the other phases are "planning" and "waiting"."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Phase:
    """A time span of a run in which the robot does one kind of thing."""

    start_ns: int
    end_ns: int
    name: str
    title: str
    support: str = ""


def phases_of(
    actions: Sequence[ActionFinished], decision_ns: Sequence[int], start_ns: int, end_ns: int
) -> tuple[Phase, ...]:
    """Actions as phases; a gap before an action is planning if a decision falls into it, else waiting.

    Args:
        actions: in order of their ends. decision_ns: stamps of decisions in nanoseconds, in order.
    """
    phases: list[Phase] = []
    at = start_ns

    def gap(until: int) -> None:
        if until > at:
            thought = bisect_right(decision_ns, until) - bisect_right(decision_ns, at - 1) > 0
            name = "planning" if thought else "waiting"
            phases.append(Phase(start_ns=at, end_ns=until, name=name, title=name))

    for action in actions:
        gap(action.start.ns)
        begin, end = max(at, action.start.ns), max(at, action.stamp.ns)
        title = describe(action)
        phases.append(
            Phase(
                start_ns=begin,
                end_ns=end,
                name=kind_of(action),
                title=title,
                support=action.support,
            )
        )
        at = end
    gap(end_ns)
    return tuple(phases)


def kind_of(action: ActionFinished) -> Kind:
    """The phase of an action: whatever is neither a move nor a look is a manipulation."""
    if action.action == "move":
        return "moving"
    return "searching" if action.action == "search" else "manipulating"


def describe(action: ActionFinished) -> str:
    """An action in words: "move to fridge 1", "pick mug at desk 1"."""
    things = action.item_types if kind_of(action) == "manipulating" else ()
    words = action_words(action.action, things, action.target)
    return words if action.success else f"{words} (refused: {humanize_ids(action.reason)})"
