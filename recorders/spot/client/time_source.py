"""Clocks of the simulated robot: wall time, or stepped time that advances only on request.

The robot's clock may be off by `skew_s`. `RunningClock` follows wall time, with a body that may run faster than
real time. `SteppedClock` stands still between requests, so that experiments are fast and repeatable.
"""

from __future__ import annotations

import time
from typing import Protocol, final

from workbench.log_schema.events import NANO

STEPPED_EPOCH_NS = 1_767_225_600 * NANO
"""2026-01-01T00:00:00Z, where stepped time begins."""


class RobotClock(Protocol):
    """The simulated robot's clock."""

    skew_s: float
    """How far the robot's clock is ahead of the clients', in seconds."""

    def body_s(self) -> float:
        """Body time in seconds."""
        ...

    def true_ns(self) -> int:
        """The clients' time in nanoseconds since the Unix epoch."""
        ...

    def robot_ns(self) -> int:
        """The robot's clock: true_ns plus the skew."""
        ...


@final
class RunningClock:
    """Wall time; body time runs `speed_up` times faster."""

    def __init__(self, *, skew_s: float = 0.0, speed_up: float = 1.0) -> None:
        self.skew_s = skew_s
        self.speed_up = speed_up
        self._born = time.monotonic()

    def body_s(self) -> float:
        return (time.monotonic() - self._born) * self.speed_up

    def true_ns(self) -> int:
        return time.time_ns()

    def robot_ns(self) -> int:
        return time.time_ns() + round(self.skew_s * NANO)


@final
class SteppedClock:
    """Time that advances only by `advance`."""

    def __init__(self, *, skew_s: float = 0.0) -> None:
        self.skew_s = skew_s
        self._passed_ns = 0

    def advance(self, seconds: float) -> None:
        self._passed_ns += round(seconds * NANO)

    def body_s(self) -> float:
        return self._passed_ns / NANO

    def true_ns(self) -> int:
        return STEPPED_EPOCH_NS + self._passed_ns

    def robot_ns(self) -> int:
        return self.true_ns() + round(self.skew_s * NANO)
