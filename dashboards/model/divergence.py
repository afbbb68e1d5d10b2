"""The first action at which two runs of one task differ, with both beliefs at that moment.

Actions are compared by what they do, not by how long they take: replays that only split the path differently (other
legs to the same place) do not diverge.
"""

from __future__ import annotations

from dataclasses import dataclass

from dashboards.model.phases import describe
from dashboards.model.timeline import Timeline
from workbench.log_schema.events import ActionFinished


@dataclass(frozen=True, slots=True, kw_only=True)
class RunDivergence:
    """The first difference of two runs.

    Attributes:
        index: how many actions they share.
        stamps_ns: when each run began the action that differs (its end, for a run that was over), in nanoseconds.
        decisions: the decision in force in each, 0 before the first.
        did: what each did, in words; "nothing more" for a run that was over.
    """

    index: int
    stamps_ns: tuple[int, int]
    decisions: tuple[int, int]
    did: tuple[str, str]


def divergence(a: Timeline, b: Timeline) -> RunDivergence | None:
    """Where two runs diverge, or None if they do the same to their ends."""
    ours, theirs = a.actions, b.actions
    for index in range(max(len(ours), len(theirs))):
        left = ours[index] if index < len(ours) else None
        right = theirs[index] if index < len(theirs) else None
        if left is None or right is None or _what(left) != _what(right):
            return RunDivergence(
                index=index,
                stamps_ns=(_stamp(a, left), _stamp(b, right)),
                decisions=(_decision(left), _decision(right)),
                did=(_words(left), _words(right)),
            )
    return None


def _what(action: ActionFinished) -> tuple[object, ...]:
    return (action.action, action.target, action.item_types, action.success)


def _stamp(timeline: Timeline, action: ActionFinished | None) -> int:
    return action.start.ns if action is not None else timeline.end_ns


def _decision(action: ActionFinished | None) -> int:
    return action.decision if action is not None else 0


def _words(action: ActionFinished | None) -> str:
    return describe(action) if action is not None else "nothing more"
