"""The clock of a log that is played: play, pause, seek, speed and end, without threads and without a real clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from workbench.errors import BadValue

MIN_SPEED, MAX_SPEED = 0.01, 1000.0


class TimeSpan(NamedTuple):
    """Log times in nanoseconds: those after the first, up to and with the second, have just passed."""

    after_ns: int
    until_ns: int


@dataclass(slots=True)
class PlaybackClock:
    """Where a log is being played. Times are in nanoseconds, as the log has them.

    Attributes:
        speed: log seconds a second.
        loop: begin again at the end.
    """

    start_ns: int
    end_ns: int
    now_ns: int
    playing: bool = False
    speed: float = 1.0
    loop: bool = False

    def __post_init__(self) -> None:
        self.set_speed(self.speed)

    @property
    def ended(self) -> bool:
        return self.now_ns >= self.end_ns and not self.playing

    def set_speed(self, speed: float) -> None:
        """Raises: BadValue: not between 0.01 and 1000."""
        if not MIN_SPEED <= speed <= MAX_SPEED:
            raise BadValue("--speed", speed, f"from {MIN_SPEED} to {MAX_SPEED:.0f}")
        self.speed = speed

    def play(self) -> bool:
        """Go on, from the start where the end was reached; whether that was a jump."""
        self.playing = True
        if self.now_ns < self.end_ns:
            return False
        self.now_ns = self.start_ns
        return True

    def pause(self) -> None:
        self.playing = False

    def seek(self, time_ns: int) -> None:
        """Jump to a time, or to the nearer end of the log."""
        self.now_ns = min(max(time_ns, self.start_ns), self.end_ns)

    def advance(self, elapsed_s: float) -> TimeSpan | None:
        """The log times that pass in so many seconds; None while nothing is played. It ends at the end of the log."""
        if not self.playing:
            return None
        before = self.now_ns
        self.now_ns = min(before + max(round(elapsed_s * 1e9 * self.speed), 0), self.end_ns)
        if self.now_ns >= self.end_ns:
            self.playing = False
        return TimeSpan(before, self.now_ns)
