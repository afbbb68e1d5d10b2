"""The two timelines of a recording: wall-clock time, and time since the run began."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import rerun as rr

from dashboards.model.timeline import Timeline

CLOCK = "time"
"""Stamps as the log has them."""
SINCE_START = "run_time"
"""Durations since the run's start."""


def time_columns(timeline: Timeline, stamps_ns: Sequence[int]) -> list[rr.TimeColumn]:
    """The index columns of rows at some stamps, in nanoseconds since the epoch."""
    stamps = np.array(stamps_ns, dtype=np.int64)
    return [
        rr.TimeColumn(CLOCK, timestamp=stamps.astype("datetime64[ns]")),
        rr.TimeColumn(SINCE_START, duration=(stamps - timeline.start_ns).astype("timedelta64[ns]")),
    ]
