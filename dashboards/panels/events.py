"""Panel of the notes on the runs and of what happened in the run in focus, by time; a click goes there."""

from __future__ import annotations

from collections.abc import Sequence

from markupsafe import Markup

from dashboards.model.clock import Clock
from dashboards.model.run_events import EventKind, RunEvent, run_events
from dashboards.panels.markup import command, html, name, table, text
from replayers.log_tools.notes import RunNote

MAX_ROWS = 300
MAX_CHARS = 400
SIGNS: dict[EventKind, str] = {"note": "▼", "decision": "|", "search": "?", "refused": "!", "end": "■"}


def events(clock: Clock, names: Sequence[str], notes: Sequence[tuple[RunNote, ...]]) -> Markup:
    """All that happened in the run in focus, with its notes; below, the notes on the other runs.

    Args:
        names: of the runs on show. notes: of each.
    """
    if not clock.timelines:
        return Markup("")
    ours = run_events(clock.timelines[0], notes[0] if notes else ())
    shown = _first_notes(ours)
    left = len(ours) - len(shown)
    more = html('<p class="muted">{} of {} events are not listed.</p>', left, len(ours)) if left else Markup("")
    rows = [
        [_moment(event.stamp_ns, clock, 0), _sign(event.kind), name(event.words, max_chars=MAX_CHARS)]
        for event in shown
    ]
    made = table(("at s", "", "what"), rows, key="events", classes=("n", "w", ""))
    return html('<div class="lp events">{}{}{}</div>', made, more, _others(clock, names, notes))


def _first_notes(found: Sequence[RunEvent]) -> list[RunEvent]:
    """At most MAX_ROWS of the events, every note among them, in order."""
    if len(found) <= MAX_ROWS:
        return list(found)
    notes = [event for event in found if event.kind == "note"][:MAX_ROWS]
    others = [event for event in found if event.kind != "note"][: MAX_ROWS - len(notes)]
    kept = {id(event) for event in (*notes, *others)}
    return [event for event in found if id(event) in kept]


def _others(clock: Clock, names: Sequence[str], notes: Sequence[tuple[RunNote, ...]]) -> Markup:
    rows = [
        [_moment(note.start_ns, clock, run), name(names[run]), name(_said(note), max_chars=MAX_CHARS)]
        for run in range(1, min(len(notes), len(clock.timelines)))
        for note in notes[run]
    ]
    if not rows:
        return Markup("")
    made = table(("at s", "run", "note"), rows[:MAX_ROWS], key="others", classes=("n", "", ""))
    return html("<h3>Notes on the other runs</h3>{}", made)


def _said(note: RunNote) -> str:
    return f"{note.author}: {note.text}" if note.author else note.text


def _sign(kind: EventKind) -> Markup:
    return html('<span title="{}">{} {}</span>', kind, SIGNS[kind], kind)


def _moment(stamp_ns: int, clock: Clock, run: int) -> Markup:
    """Seconds after the run's own start; a click puts the clock there."""
    second = clock.timelines[run].seconds(stamp_ns)
    reading = clock.reading(stamp_ns, run=run)
    return html('<span class="seek" {}>{}</span>', command(f"seek {max(reading, 0.0):.9f}"), text(f"{second:.1f}"))
