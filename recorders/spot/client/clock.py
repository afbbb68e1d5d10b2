"""Clocks of a robot session: conversion of robot time by time sync, and waiting.

bosdyn-client estimates the skew between the robot's clock and ours from round trips (TimeSyncService); robot stamps
minus the skew are in our time. Its thread ends for good at the first call that fails, while its endpoint goes on with
the last skew: SyncedClock notices, starts it again, and reports how old the skew is. Waiting also goes through the
clock, so that a simulated robot can be stepped.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol, final

from recorders.spot.client.time_source import SteppedClock
from workbench.log_schema.events import NANO

if TYPE_CHECKING:
    from bosdyn.client.time_sync import TimeSyncEndpoint, TimeSyncThread

STALE_NS = 15 * NANO
"""A skew that was not measured again for this long is uncertain."""
RESTART_S, POLL_S = 1.0, 0.02
"""How long refresh waits for a new skew after it started a dead thread again, and how often it looks."""


class SessionClock(Protocol):
    """The client's clock during a robot session."""

    def now_ns(self) -> int: ...

    def sleep(self, seconds: float) -> None: ...

    def from_robot(self, robot_ns: int) -> int:
        """Convert a robot stamp to our time, both in nanoseconds."""
        ...

    def skew_ns(self) -> int:
        """How far the robot's clock is ahead of ours, in nanoseconds."""
        ...

    def uncertain(self) -> bool:
        """Whether robot stamps are converted by a skew that is old."""
        ...

    def refresh(self) -> None:
        """Update the time sync, where needed, before a command with a deadline."""
        ...


@final
class SyncedClock:
    """Wall-clock time, with bosdyn's time sync for robot time. Keeps the last skew while the network is down.

    Args:
        thread: bosdyn's time-sync thread, started.
        monotonic_ns: a clock for the age of the skew, in nanoseconds.
    """

    def __init__(self, thread: TimeSyncThread, *, monotonic_ns: Callable[[], int] = time.monotonic_ns) -> None:
        self._thread = thread
        self._monotonic_ns = monotonic_ns
        self._skew_ns = 0
        self._response: object = None
        self._measured_ns = monotonic_ns()
        self._ended = False
        """Whether the thread had ended since the last answer: while it is tried again, nothing is certain yet."""

    def now_ns(self) -> int:
        return time.time_ns()

    def sleep(self, seconds: float) -> None:
        time.sleep(seconds)

    def from_robot(self, robot_ns: int) -> int:
        return robot_ns - self.skew_ns()

    def skew_ns(self) -> int:
        self._note_answer()
        if self._thread.endpoint.has_established_time_sync:
            skew = self._thread.endpoint.clock_skew
            self._skew_ns = skew.seconds * NANO + skew.nanos
        return self._skew_ns

    def round_trip_ns(self) -> int:
        """Shortest round trip of the time sync in nanoseconds; 0 before the first."""
        duration = self._thread.endpoint.round_trip_time
        return 0 if duration is None else duration.seconds * NANO + duration.nanos

    def uncertain(self) -> bool:
        """Whether stamps are converted by an old skew: its thread has ended, or it was not measured for STALE_NS."""
        self._note_answer()
        self._ended |= self._thread.stopped
        return self._ended or self._monotonic_ns() - self._measured_ns > STALE_NS

    def refresh(self) -> None:
        """Starts the time-sync thread again if it has ended, and waits a moment for its first answer."""
        self._note_answer()
        if not self._thread.stopped:
            return
        self._ended = True
        self._thread.start()
        tries = round(RESTART_S / POLL_S)
        while tries > 0 and not self._thread.stopped and self._thread.endpoint.response is self._response:
            time.sleep(POLL_S)
            tries -= 1
        self._note_answer()

    def _note_answer(self) -> None:
        """Notes when the endpoint's answer was replaced: it is, at every exchange."""
        response = self._thread.endpoint.response
        if response is not self._response:
            self._response, self._measured_ns = response, self._monotonic_ns()
            self._ended = False


@final
class SteppedSessionClock:
    """Stepped time shared with the simulated robot: it advances only while waiting.

    `on_step` is called at every step, where the session samples its sensors.
    """

    def __init__(self, clock: SteppedClock, endpoint: TimeSyncEndpoint | None = None) -> None:
        self._clock = clock
        self.endpoint = endpoint
        self.on_step: Callable[[], None] | None = None

    def now_ns(self) -> int:
        return self._clock.true_ns()

    def sleep(self, seconds: float) -> None:
        self._clock.advance(seconds)
        if self.on_step is not None:
            self.on_step()

    def from_robot(self, robot_ns: int) -> int:
        return robot_ns - self.skew_ns()

    def skew_ns(self) -> int:
        return round(self._clock.skew_s * NANO)

    def uncertain(self) -> bool:
        return False

    def refresh(self) -> None:
        if self.endpoint is not None:
            for _ in range(2):
                self.endpoint.get_new_estimate()
