"""The state of a session in one message a second, for the log, the terminal and viewers that follow."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, field
from pathlib import Path

from recorders.sinks.files import Sink
from recorders.sinks.threaded import ThreadedSink
from recorders.spot.session.topics import SessionStatus
from workbench.log_schema.events import NANO, Stamp

TAGS_NOW_NS = 2 * NANO
"""A tag is seen now if it was detected within this time."""
SILENT_S = 1.0
"""Seconds without an answer of the robot from which the link is reported as down."""
TAGS_SHOWN = 3


@dataclass(slots=True)
class LiveStatus:
    """The last reports of a session's streams; each part is set by one thread.

    Attributes:
        battery_percent: 0 to 100; negative until the robot reports it.
        tags: when each tag was last detected, by the name of its item, or its number.
        doing: what the robot is about to do, in words; "" where it is not driven from here.
    """

    battery_percent: float = -1.0
    localized: bool = False
    tags: dict[str, int] = field(default_factory=dict)
    doing: str = ""

    def now(self, now_ns: int, *, answered_ns: int, sink: Sink) -> SessionStatus:
        """The message of this moment.

        Args:
            answered_ns: when the robot last answered; 0 before.
        """
        seen = sorted(name for name, at_ns in list(self.tags.items()) if now_ns - at_ns < TAGS_NOW_NS)
        return SessionStatus(
            stamp=Stamp.of(now_ns),
            battery_percent=self.battery_percent,
            localized=self.localized,
            silent_s=max(now_ns - answered_ns, 0) / NANO if answered_ns else 0.0,
            tags=tuple(seen),
            dropped=sum(sink.dropped.values()) if isinstance(sink, ThreadedSink) else 0,
            disk_free_mb=_free_mb(sink.path),
            doing=self.doing,
        )


def status_words(status: SessionStatus) -> str:
    """A status in one line: what is wrong first, then what the robot is about to do."""
    wrong: list[str] = []
    if status.silent_s > SILENT_S:
        wrong.append(f"NO ANSWER for {status.silent_s:.0f} s")
    if not status.localized:
        wrong.append("NOT LOCALISED")
    if status.dropped:
        wrong.append(f"{status.dropped} messages DROPPED")
    doing = [f"next: {status.doing}"] if status.doing else []
    battery = [f"battery {status.battery_percent:.0f} %"] if status.battery_percent >= 0 else []
    more = len(status.tags) - TAGS_SHOWN
    tags = ", ".join(status.tags[:TAGS_SHOWN]) + (f" and {more} more" if more > 0 else "") or "no tag"
    return " | ".join([*wrong, *doing, *battery, f"sees {tags}", f"{status.disk_free_mb / 1000:.1f} GB free"])


def _free_mb(output: Path) -> int:
    """Free space on the disk of a file in MB; 0 where it is unknown."""
    try:
        return shutil.disk_usage(output.absolute().parent).free // 1_000_000
    except OSError:
        return 0
