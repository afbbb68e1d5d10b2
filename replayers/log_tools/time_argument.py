"""Parses a moment: seconds from a log's start, an RFC 3339 time, or nanoseconds since the epoch."""

from __future__ import annotations

from datetime import UTC, datetime
from math import isfinite

from workbench.errors import BadValue
from workbench.log_schema.events import NANO

EPOCH_FROM = 10**15
"""A whole number from here on is nanoseconds since the epoch (11 days into 1970); below it is seconds."""
END_OF_TIME_NS = (1 << 64) - 1


def moment(text: str, *, start_ns: int, option: str) -> int:
    """A moment in nanoseconds since the epoch.

    Args:
        text: "12.4" (seconds from the start), "2026-01-01T10:00:00Z", or "1767225600000000000".
        start_ns: when the log begins, in nanoseconds since the epoch.
        option: the name of the option, for the error.

    Raises:
        BadValue: none of these.
    """
    if text.isdigit() and len(text) < 21 and int(text) >= EPOCH_FROM:
        return min(int(text), END_OF_TIME_NS)
    try:
        seconds = float(text)
    except ValueError:
        seconds = None
    if seconds is not None and isfinite(seconds) and abs(seconds) < 1e10:
        return min(max(start_ns + round(seconds * NANO), 0), END_OF_TIME_NS)
    try:
        when = datetime.fromisoformat(text)
    except ValueError:
        raise BadValue(option, text, "seconds from the start, an RFC 3339 time, or nanoseconds") from None
    when = when if when.tzinfo else when.replace(tzinfo=UTC)
    since = when - datetime(1970, 1, 1, tzinfo=UTC)
    return max((since.days * 86_400 + since.seconds) * NANO + since.microseconds * 1000, 0)
