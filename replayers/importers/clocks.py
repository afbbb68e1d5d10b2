"""The clock of a bag's events: the messages' own header stamps, or the times at which they were recorded.

A bag may hold two clocks that have nothing to do with one another: headers in simulated time and record times of the
wall. One of them is used for everything. Stamps of latched messages (static transforms, maps) never count: they were
made when a node started.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, final

import numpy as np

from workbench.arrays import Ints
from workbench.errors import Malformed
from workbench.log_schema.events import NANO
from workbench.message_enum import MessageEnum, Result

ClockName = Literal["record", "header"]
CLOCKS: tuple[ClockName, ...] = ("record", "header")

APART_NS = 60 * NANO
"""Header and record times further apart than this are of two clocks."""
JUMP_NS = NANO
"""A header stamp this far before an earlier one of its topic is a jump back, no delay of a message."""
GAP_NS = 24 * 3600 * NANO
"""A gap this long inside a bag means that a clock was set, not that a robot waited."""
INTERLEAVED = 3
"""More jumps back than this on one topic mean that the record clock was set back: two stretches of time lie over one
another."""
SLACK_NS = NANO
"""How long before the first record time a message may have been made."""


class ClockUse(MessageEnum):
    """Whether a clock gives an order of events, and if not, why."""

    USABLE = ""
    RECORD_SET_BACK = "header stamps jump back {jumps} times in the order of recording: the record clock was set back"
    HEADER_JUMPS_BACK = "header stamps jump back {times} inside the bag"
    GAP = "{stamps} leave a gap of {days} days, so the clock was set inside the bag"


class ClockReason(MessageEnum):
    """Why there was a choice of clocks."""

    APART = "header stamps and record times are {seconds} s apart"
    JUMPS_BACK = "header stamps jump back ({jumps})"
    ZERO_STAMPS = "header stamps of zero ({zeros})"


class BrokenClocks(Malformed):
    """A bag whose times cannot be put in order."""

    def __init__(self, path: Path, reason: str, fix: str) -> None:
        super().__init__(f"{path}: {reason}. {fix}.")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class BagClock:
    """The clock used for all events of a bag.

    Attributes:
        name: whose times they are.
        offset_ns: header time minus record time where those are of two clocks, else 0; used for messages without a
            header stamp.
        start_ns: the first time, of messages that are not latched.
        apart_s: median difference of header and record times in seconds, of the topic where it is largest.
        zero_stamps: messages whose header stamp is zero, as before the first message on /clock.
        jumps_back: how often header stamps jump back on a topic.
        reasons: why there was a choice of clocks; empty where there was none.
        requested: whether the user named the clock.
    """

    name: ClockName
    offset_ns: int
    start_ns: int
    apart_s: float = 0.0
    zero_stamps: int = 0
    jumps_back: int = 0
    reasons: tuple[Result[ClockReason], ...] = ()
    requested: bool = False

    @property
    def note(self) -> str:
        """What was chosen and why, as a line of the report; "" where there was no choice."""
        if not self.reasons:
            return ""
        times, other = ("record times", "header") if self.name == "record" else ("header stamps", "record")
        way = "" if self.requested else f" (--clock {other} for the other)"
        return f"{'; '.join(reason.message for reason in self.reasons)}: {times} are used throughout{way}"

    def as_json(self) -> dict[str, str | int | float]:
        """The clock as an entry of a report."""
        return {
            "name": self.name,
            "offset_ns": self.offset_ns,
            "start_ns": self.start_ns,
            "apart_s": self.apart_s,
            "zero_stamps": self.zero_stamps,
            "jumps_back": self.jumps_back,
            "note": self.note,
        }

    def time_of(self, record_ns: int, header_ns: int, *, latched: bool = False) -> int:
        """A message's time in nanoseconds.

        Args:
            record_ns: when it was recorded.
            header_ns: its own stamp; 0 without one.
            latched: whether it was made at a start and not when something happened.
        """
        expected = record_ns + (self.offset_ns if self.name == "header" else 0)
        if latched or self.name == "record" or header_ns <= 0 or abs(header_ns - expected) > APART_NS:
            return max(expected, self.start_ns)
        return max(header_ns, self.start_ns)


@final
@dataclass(slots=True)
class ClockSurvey:
    """Collects the times of a bag's messages, latched ones left out."""

    _times: dict[str, list[tuple[int, int]]] = field(default_factory=dict)

    def add(self, topic: str, record_ns: int, header_ns: int) -> None:
        """Takes a message's record time and header stamp (0 without one)."""
        self._times.setdefault(topic, []).append((record_ns, header_ns))

    def choose(self, path: Path, requested: ClockName | None, otherwise_ns: int, zeros: int) -> BagClock:
        """The clock of the bag: the requested one, else header stamps unless they are of another clock or jump back.

        Args:
            requested: the user's choice, None for the rule.
            otherwise_ns: the start where nothing but latched messages is there.
            zeros: header stamps of zero.

        Raises:
            BrokenClocks: no clock, or not the requested one, gives an order of events.
        """
        topics = [np.array(times, dtype=np.int64).reshape(-1, 2) for _, times in sorted(self._times.items())]
        if not topics:
            return BagClock(name=requested or "header", offset_ns=0, start_ns=otherwise_ns, zero_stamps=zeros)
        apart = max((_offset(times) for times in topics), key=abs)
        jumps = [_jumps_back(times) for times in topics]
        interleaved = max(jumps) > INTERLEAVED
        differ = abs(apart) > APART_NS
        facts: dict[ClockName, BagClock] = {
            name: BagClock(
                name=name,
                offset_ns=_common_offset(topics) if name == "header" else 0,
                start_ns=min(int(times[:, 0].min()) for times in topics),
                apart_s=apart / NANO,
                zero_stamps=zeros,
                jumps_back=sum(jumps),
            )
            for name in CLOCKS
        }
        started = {name: _with_start(clock, topics) for name, clock in facts.items()}
        uses: dict[ClockName, Result[ClockUse]] = {
            name: _use_of(started[name], topics, sum(jumps), interleaved=interleaved) for name in CLOCKS
        }
        usable: list[ClockName] = [name for name in CLOCKS if uses[name].kind is ClockUse.USABLE]
        chosen: ClockName = requested or ("record" if differ or "header" not in usable else "header")
        if requested is None and chosen not in usable and "header" in usable:
            chosen = "header"
        if chosen not in usable:
            raise BrokenClocks(path, uses[chosen].message, _way_out(chosen, usable))
        return _explained(started[chosen], differ=differ, requested=requested is not None)


def _use_of(clock: BagClock, topics: list[Ints], jumps: int, *, interleaved: bool) -> Result[ClockUse]:
    """Whether a clock gives an order of events."""
    if interleaved:
        return ClockUse.RECORD_SET_BACK.result(jumps=str(jumps))
    if clock.name == "header" and jumps:
        return ClockUse.HEADER_JUMPS_BACK.result(times=f"{jumps} {'time' if jumps == 1 else 'times'}")
    times = np.sort(_times(clock, topics))
    gap = int(np.diff(times).max(initial=0))
    if gap > GAP_NS:
        stamps = "header stamps" if clock.name == "header" else "record times"
        return ClockUse.GAP.result(stamps=stamps, days=f"{gap / NANO / 86400:.0f}")
    return ClockUse.USABLE.result()


def _offset(times: Ints) -> int:
    """Median header minus record time, of messages with a header stamp; 0 without any; shape (messages, 2)."""
    stamped = times[times[:, 1] > 0]
    return int(np.median(stamped[:, 1] - stamped[:, 0])) if len(stamped) else 0


def _common_offset(topics: list[Ints]) -> int:
    """The median difference over all messages; 0 where the clocks agree."""
    offset = _offset(np.concatenate(topics))
    return offset if abs(offset) > APART_NS else 0


def _jumps_back(times: Ints) -> int:
    """How often header stamps fall behind the one before by more than a late message does."""
    headers = times[times[:, 1] > 0, 1]
    return int((np.diff(headers) < -JUMP_NS).sum())


def _times(clock: BagClock, topics: list[Ints]) -> Ints:
    """The times of all messages by a clock, unordered; as BagClock.time_of without the start."""
    both = np.concatenate(topics)
    expected = both[:, 0] + (clock.offset_ns if clock.name == "header" else 0)
    if clock.name == "record":
        return expected
    usable = (both[:, 1] > 0) & (np.abs(both[:, 1] - expected) <= APART_NS)
    return np.where(usable, both[:, 1], expected)


def _with_start(clock: BagClock, topics: list[Ints]) -> BagClock:
    first = min(int(times[:, 0].min()) for times in topics) + clock.offset_ns
    return replace(clock, start_ns=max(first - SLACK_NS, int(_times(clock, topics).min())))


def _way_out(chosen: ClockName, usable: Collection[ClockName]) -> str:
    other: ClockName = "header" if chosen == "record" else "record"
    if other in usable:
        return f"Import with --clock {other}"
    return "Cut the bag where the clock was set, and import the parts"


def _explained(clock: BagClock, *, differ: bool, requested: bool) -> BagClock:
    reasons: list[Result[ClockReason]] = []
    if differ:
        reasons.append(ClockReason.APART.result(seconds=f"{abs(clock.apart_s):,.0f}"))
    if clock.jumps_back:
        reasons.append(ClockReason.JUMPS_BACK.result(jumps=str(clock.jumps_back)))
    if clock.zero_stamps:
        reasons.append(ClockReason.ZERO_STAMPS.result(zeros=str(clock.zero_stamps)))
    return replace(clock, reasons=tuple(reasons), requested=requested)
