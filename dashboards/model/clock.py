"""Common clocks of several runs: by time, by metres walked, or by decision.

A clock turns one reading (seconds, metres or a decision's number) into a stamp of each run, so that one slider moves
all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from dashboards.model.timeline import Timeline
from workbench.errors import BadValue

Alignment = Literal["time", "distance", "decision"]
ALIGNMENTS: tuple[Alignment, ...] = get_args(Alignment)
UNITS: dict[Alignment, str] = {"time": "s", "distance": "m", "decision": ""}


@dataclass(frozen=True, slots=True, kw_only=True)
class Clock:
    """Several runs on one clock; the first is in focus.

    Raises:
        BadValue: another alignment than time, distance or decision.
    """

    timelines: tuple[Timeline, ...]
    alignment: Alignment = "time"

    def __post_init__(self) -> None:
        if self.alignment not in ALIGNMENTS:
            raise BadValue("alignment", self.alignment, "one of " + ", ".join(ALIGNMENTS))

    @property
    def end(self) -> float:
        """The last reading of any run, at least a small positive one so that a slider has a length."""
        return max([self._last(t) for t in self.timelines] or [0.0]) or 1.0

    def stamps(self, reading: float) -> tuple[int, ...]:
        """The stamp of each run at a reading, in nanoseconds; a run that is over stays at its end."""
        return tuple(self._stamp(t, reading) for t in self.timelines)

    def reading(self, stamp_ns: int, *, run: int = 0) -> float:
        """The reading at a stamp of a run."""
        timeline = self.timelines[run]
        second = timeline.seconds(stamp_ns)
        if self.alignment == "time":
            return second
        if self.alignment == "distance":
            return float(np.interp(second, timeline.path_s, timeline.path_m))
        return float(timeline.decision_at(stamp_ns) + 1)

    def position(self, stamp_ns: int, *, run: int = 0) -> float:
        """As `reading`, but on the clock of decisions a stamp within a decision is interpolated by its time."""
        if self.alignment != "decision":
            return self.reading(stamp_ns, run=run)
        timeline = self.timelines[run]
        starts = (timeline.start_ns, *timeline.decision_ns, timeline.end_ns)
        number = min(timeline.decision_at(stamp_ns), len(timeline.decisions) - 1) + 1
        begin, end = starts[number], starts[number + 1]
        share = (stamp_ns - begin) / (end - begin) if end > begin else 0.0
        return number + min(max(share, 0.0), 1.0)

    def decisions(self) -> tuple[float, ...]:
        """Readings at the decisions of the run in focus."""
        return tuple(self.reading(stamp) for stamp in self.timelines[0].decision_ns) if self.timelines else ()

    def actions(self) -> tuple[float, ...]:
        """Readings at the starts of actions of the run in focus."""
        return tuple(self.reading(stamp) for stamp in self.timelines[0].action_ns) if self.timelines else ()

    def _last(self, timeline: Timeline) -> float:
        if self.alignment == "time":
            return timeline.duration_s
        if self.alignment == "distance":
            return float(timeline.path_m[-1])
        return float(len(timeline.decisions) + 1)

    def _stamp(self, timeline: Timeline, reading: float) -> int:
        if self.alignment == "time":
            return timeline.stamp(min(max(reading, 0.0), timeline.duration_s))
        if self.alignment == "distance":
            if reading >= timeline.path_m[-1]:
                return timeline.end_ns
            i = int(np.searchsorted(timeline.path_m, reading, side="right"))
            before, after = timeline.path_m[i - 1], timeline.path_m[i]
            share = (reading - before) / (after - before)
            return timeline.stamp(timeline.path_s[i - 1] + share * (timeline.path_s[i] - timeline.path_s[i - 1]))
        number = int(reading)
        if number < 1:
            return timeline.start_ns
        if number > len(timeline.decisions):
            return timeline.end_ns
        return timeline.decision_ns[number - 1]
