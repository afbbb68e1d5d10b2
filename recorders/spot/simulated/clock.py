"""What time is it for a robot that is not there? Wall time, as on a robot, or time that passes only when asked.

The robot's own clock may be wrong by `skew_s`, as a robot's is. `RunningClock` follows the wall, with a body that may
live faster than life. `SteppedClock` stands still between questions: experiments on it are quick and repeatable.
"""

from __future__ import annotations

import time
from typing import Protocol, final

from workbench.runs.vocabulary import NANO

STEPPED_EPOCH_NS = 1_767_225_600 * NANO
"""2026-01-01T00:00:00Z, where stepped time begins."""


class RobotClock(Protocol):
    """The simulated robot's clock."""

    skew_s: float
    """By how much the robot's clock is ahead of its users'."""

    def body_s(self) -> float:
        """Seconds that the body has lived."""
        ...

    def true_ns(self) -> int:
        """The time of its users, nanoseconds since the Unix epoch."""
        ...

    def robot_ns(self) -> int:
        """What the robot's clock shows: true_ns and its skew."""
        ...


@final
class RunningClock:
    """Wall time; the body lives `speed_up` seconds in each."""

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
    """Time that passes only by `advance`."""

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
