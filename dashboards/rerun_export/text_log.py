"""Events of a run as lines of text: decisions, actions, looks, the outcome, and people's notes."""

from __future__ import annotations

from collections.abc import Sequence

import rerun as rr

from dashboards.model.labels import action_words, humanize_ids, place_words
from dashboards.model.timeline import Timeline
from dashboards.rerun_export.times import time_columns
from replayers.log_tools.notes import RunNote
from workbench.worlds.names import readable_name

Line = tuple[int, str, str]
"""(stamp in nanoseconds since the epoch, level, text)."""


def log_words(recording: rr.RecordingStream, timeline: Timeline, notes: Sequence[RunNote]) -> None:
    """Write the lines of a run, one entity for each kind."""
    for path, lines in lines_of(timeline, notes).items():
        recording.send_columns(
            path,
            time_columns(timeline, [stamp for stamp, _, _ in lines]),
            rr.TextLog.columns(text=[text for _, _, text in lines], level=[level for _, level, _ in lines]),
        )


def lines_of(timeline: Timeline, notes: Sequence[RunNote]) -> dict[str, list[Line]]:
    """The lines of a run by entity path, each in order; kinds without lines are left out."""
    run = timeline.run
    names = {*timeline.item_types, *(c.id for c in timeline.plan.containers)}
    made: dict[str, list[Line]] = {
        "log/decisions": [
            (frame.stamp_ns, "INFO", humanize_ids(frame.plan.reason, names))
            for frame in timeline.decisions
            if frame.plan is not None and frame.plan.reason
        ],
        "log/actions": [
            (
                action.stamp.ns,
                "INFO" if action.success else "WARN",
                action_words(action.action, action.item_types, action.target)
                + ("" if action.success else " (refused)"),
            )
            for action in timeline.actions
        ],
        "log/looks": [
            (
                look.stamp.ns,
                "INFO",
                f"{place_words(look.container)}: "
                + (", ".join(readable_name(item.type) for item in look.items) or "nothing")
                + (" (known at the start)" if look.known_at_start else ""),
            )
            for look in sorted(run.observations, key=lambda look: look.stamp.ns)
        ],
        "log/notes": [
            (note.start_ns, "INFO", f"{note.author}: {note.text}" if note.author else note.text) for note in notes
        ],
    }
    if run.outcome is not None:
        ended = run.outcome
        words = f"{ended.status}, cost {ended.cost:.2f}" + (
            f": {humanize_ids(ended.reason, names)}" if ended.reason else ""
        )
        made["log/outcome"] = [(ended.stamp.ns, "INFO" if ended.status == "done" else "WARN", words)]
    return {path: lines for path, lines in made.items() if lines}
