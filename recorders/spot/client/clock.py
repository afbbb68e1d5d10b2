"""Clocks of a robot session: conversion of robot time by time sync, and waiting.

bosdyn-client estimates the skew between the robot's clock and ours from round trips (TimeSyncService); robot stamps
minus the skew are in our time. Waiting also goes through the clock, so that a simulated robot can be stepped.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol, final

from recorders.spot.client.time_source import SteppedClock
from workbench.log_schema.events import NANO

if TYPE_CHECKING:
    from bosdyn.client.time_sync import TimeSyncEndpoint


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

    def refresh(self) -> None:
        """Update the time sync, where needed, before a command with a deadline."""
        ...


@final
class SyncedClock:
    """Wall-clock time, with bosdyn's time sync for robot time. Keeps the last skew while the network is down."""

    def __init__(self, endpoint: TimeSyncEndpoint) -> None:
        self._endpoint = endpoint
        self._skew_ns = 0

    def now_ns(self) -> int:
        return time.time_ns()

    def sleep(self, seconds: float) -> None:
        time.sleep(seconds)

    def from_robot(self, robot_ns: int) -> int:
        return robot_ns - self.skew_ns()

    def skew_ns(self) -> int:
        if self._endpoint.has_established_time_sync:
            skew = self._endpoint.clock_skew
            self._skew_ns = skew.seconds * NANO + skew.nanos
        return self._skew_ns

    def round_trip_ns(self) -> int:
        """Shortest round trip of the time sync in nanoseconds; 0 before the first."""
        duration = self._endpoint.round_trip_time
        return 0 if duration is None else duration.seconds * NANO + duration.nanos

    def refresh(self) -> None:
        """Does nothing: the time-sync thread updates the skew."""


@final
class Stepped:
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

    def refresh(self) -> None:
        if self.endpoint is not None:
            for _ in range(2):
                self.endpoint.get_new_estimate()
