"""Events of a run and people's notes, as one list by time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from dashboards.model.containers.container_history import wanted_words
from dashboards.model.labels import humanize_ids, place_words
from dashboards.model.phases import describe
from dashboards.model.timeline import Timeline
from replayers.log_tools.notes import RunNote

EventKind = Literal["refused", "search", "decision", "note", "end"]
KINDS: tuple[EventKind, ...] = get_args(EventKind)
"""In the order in which events of one moment follow on one another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunEvent:
    """One moment of a run, in words that are those of the log."""

    stamp_ns: int
    kind: EventKind
    words: str


def run_events(timeline: Timeline, notes: Sequence[RunNote]) -> tuple[RunEvent, ...]:
    """Notes, decisions with their reasons, searches with the goal's items found, refused actions, and the end."""
    names = (*timeline.item_types, *(str(c.id) for c in timeline.plan.containers))
    events = [RunEvent(stamp_ns=note.start_ns, kind="note", words=_said(note)) for note in notes]
    for frame in timeline.decisions:
        reason = humanize_ids(frame.plan.reason, names) if frame.plan is not None else ""
        events.append(RunEvent(stamp_ns=frame.stamp_ns, kind="decision", words=f"{frame.number}: {reason}"))
    for seen in timeline.run.observations:
        if not seen.known_at_start:
            found = wanted_words(timeline, seen.items)
            words = f"{place_words(seen.container)}: {len(seen.items)} items{', ' + found if found else ''}"
            events.append(RunEvent(stamp_ns=seen.stamp.ns, kind="search", words=words))
    for sighting in timeline.run.sightings:
        words = f"{place_words(sighting.container)}: {wanted_words(timeline, (sighting.item,))} in passing"
        events.append(RunEvent(stamp_ns=sighting.stamp.ns, kind="search", words=words))
    for action in timeline.actions:
        if not action.success:
            events.append(RunEvent(stamp_ns=action.stamp.ns, kind="refused", words=describe(action)))
    outcome = timeline.run.outcome
    if outcome is not None:
        why = f": {humanize_ids(outcome.reason, names)}" if outcome.reason else ""
        events.append(RunEvent(stamp_ns=outcome.stamp.ns, kind="end", words=f"{outcome.status}{why}"))
    return tuple(sorted(events, key=lambda event: (event.stamp_ns, KINDS.index(event.kind))))


def _said(note: RunNote) -> str:
    return f"{note.author}: {note.text}" if note.author else note.text
