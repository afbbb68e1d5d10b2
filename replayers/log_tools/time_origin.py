"""The moment from which the seconds of a log count.

A run's log counts from the run's first event. Another log counts from the bulk of its messages: a few that were
latched long before (a map, a static transform) would stretch its time span.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

from recorders.mcap_io.index import LogIndex
from replayers.mcap_io.reader import messages
from workbench.log_schema.events import RunInfo

MAX_EARLY_MESSAGES = 1000
"""Messages before the bulk that are looked at."""
EARLY_SHARE = 0.05
"""Messages before the bulk are at most this share of all, or one."""


class OriginKind(StrEnum):
    """What the seconds of a log count from."""

    RUN = "the run's first event"
    BULK = "the bulk of the messages"
    FIRST = "the first message"


class TimeOrigin(NamedTuple):
    """A log's origin in nanoseconds since the epoch, what it is, and how many messages are earlier."""

    stamp_ns: int
    kind: OriginKind
    earlier: int = 0


def time_origin(path: Path, index: LogIndex, info: RunInfo | None) -> TimeOrigin:
    """The origin of a log's seconds.

    The stamps of all messages are read only where the index shows that they may lie far apart.
    """
    if info is not None and index.first_ns <= info.started.ns <= index.last_ns:
        return TimeOrigin(info.started.ns, OriginKind.RUN)
    if _evenly_spread(index):
        return TimeOrigin(index.first_ns, OriginKind.FIRST)
    return bulk_start((m.log_time for m in messages(path)), count=index.messages, last_ns=index.last_ns)


def bulk_start(stamps_ns: Iterable[int], *, count: int, last_ns: int) -> TimeOrigin:
    """Where the bulk of stamps begins: after a gap that is longer than all that follows it.

    Memory: MAX_EARLY_MESSAGES stamps.
    """
    earliest = heapq.nsmallest(min(MAX_EARLY_MESSAGES, max(int(count * EARLY_SHARE), 1)) + 1, stamps_ns)
    if not earliest:
        return TimeOrigin(0, OriginKind.FIRST)
    for number in range(len(earliest) - 1, 0, -1):
        if earliest[number] - earliest[number - 1] > last_ns - earliest[number] and count - number > 1:
            return TimeOrigin(earliest[number], OriginKind.BULK, number)
    return TimeOrigin(earliest[0], OriginKind.FIRST)


def _evenly_spread(index: LogIndex) -> bool:
    """Whether every gap between messages is shorter than half of the log, by the times of its chunks."""
    half = (index.last_ns - index.first_ns) / 2
    reached = index.first_ns
    for chunk in sorted(index.chunks, key=lambda c: c.message_start_time):
        if chunk.message_start_time == chunk.message_end_time == 0:
            continue  # an empty chunk
        if max(chunk.message_start_time - reached, chunk.message_end_time - chunk.message_start_time) >= half:
            return False
        reached = max(reached, chunk.message_end_time)
    return bool(index.chunks) or index.first_ns == index.last_ns
