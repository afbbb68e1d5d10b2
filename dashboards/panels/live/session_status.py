"""Panel of how a robot's session goes: what is wrong first, then what comes next, battery, tags, disk, and keys."""

from __future__ import annotations

from markupsafe import Markup

from dashboards.palette import FAILED, css
from dashboards.panels.markup import chip, html, name, text
from recorders.spot.run.operator_requests import RUN_KEYS
from recorders.spot.session.live_status import SILENT_S
from recorders.spot.session.topics import SessionStatus
from workbench.log_schema.events import NANO

OLD_S = 5.0
"""Seconds after which a state is reported as old: one comes every second while a session is recorded."""
LOW_BATTERY_PERCENT, LOW_DISK_MB = 30.0, 1000
"""Below these a figure is marked: a run begins with no less of the battery (spot.md)."""
TAGS_SHOWN = 6
OPERATOR = "operator"
"""The strategy that the log of a recorded session names (recorders/spot/record_session.py)."""
RECORD_KEYS = "Keys: n note, m mark, o opened, d done, f failed, q end."
"""Those of a session that somebody else drives."""


def session_status(status: SessionStatus | None, stamp_ns: int, *, live: bool, strategy: str) -> Markup:
    """The state of the session at a moment.

    Args:
        live: whether the newest moment of a session that is being recorded is shown; its keys are then listed.
        strategy: what drives the robot; an operator's session takes other keys than a run.
    """
    if status is None:
        return Markup("")
    marks = Markup(" ").join([*_wrong(status, stamp_ns), *_figures(status)])
    tags = ", ".join(status.tags[:TAGS_SHOWN]) or "no tag"
    more = f" and {len(status.tags) - TAGS_SHOWN} more" if len(status.tags) > TAGS_SHOWN else ""
    following = html("<p>Next: {}</p>", name(status.doing)) if status.doing else ""
    keys = ""
    if live:
        known = RECORD_KEYS if strategy == OPERATOR else RUN_KEYS
        keys = html('<p class="muted">In the terminal that records it: {}</p>', text(known))
    seen = html('<p class="muted">Sees {}{}</p>', name(tags), more)
    return html('<div class="lp session"><p>{}</p>{}{}{}</div>', marks, following, seen, keys)


def _wrong(status: SessionStatus, stamp_ns: int) -> list[Markup]:
    """What is wrong, as chips of the colour of failures."""
    old_s = (stamp_ns - status.stamp.ns) / NANO
    found = [
        (old_s > OLD_S, f"as of {old_s:.0f} s ago"),
        (status.silent_s > SILENT_S, f"no answer for {status.silent_s:.0f} s"),
        (not status.localized, "not localised"),
        (status.dropped > 0, f"{status.dropped} messages dropped"),
    ]
    return [chip(words, css(FAILED), dark=True) for wrong, words in found if wrong]


def _figures(status: SessionStatus) -> list[Markup]:
    shown: list[Markup] = []
    if status.battery_percent >= 0:
        low = status.battery_percent < LOW_BATTERY_PERCENT
        shown.append(_figure(f"battery {status.battery_percent:.0f} %", low=low))
    if status.localized:
        shown.append(_figure("localised", low=False))
    if status.silent_s <= SILENT_S:
        shown.append(_figure("link up", low=False))
    if status.disk_free_mb:
        shown.append(_figure(f"{status.disk_free_mb / 1000:.1f} GB free", low=status.disk_free_mb < LOW_DISK_MB))
    return shown


def _figure(words: str, *, low: bool) -> Markup:
    return chip(words, css(FAILED), dark=True) if low else chip(words, "#e6e8eb")
