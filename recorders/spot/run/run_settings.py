"""The settings of motion and perception of a run on a robot."""

from __future__ import annotations

from dataclasses import dataclass

from workbench.errors import BadValue

LONGEST_HOLD_S, SHORTEST_HOLD_S = 3.0, 0.6
"""Limits in seconds of how long a command to walk holds: a slow robot does not stay uncommanded for longer, and over
Wi-Fi a command cannot be renewed reliably within less."""
HOLD_SHARE = 0.9
"""The share of the permitted way that a command may use; the rest is for braking and the error of the time sync."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSettings:
    """Settings of motion and perception.

    Attributes:
        speed_mps: speed limit of walking; None for the site's.
        stop_within_m: how far the robot walks on at most when nobody renews its command.
        sees_m: how far from a container the tag of an item in it counts that is seen in passing; 0 for not at all.
        look_s: duration of a look, within which tags must be seen.
        poll_s: polling interval.
        outage_s: duration of a network outage after which the robot counts as having stopped by itself, also where
            it was not walking.
        patience_s: network outage after which the run ends.
        walk_factor: time limit of a walk as a multiple of its expected time.
        attempts, retry_s: number of attempts of a blocked or lost walk, and the pause between them, since
            people step aside.
        resume: whether the robot goes on by itself after an outage in which it stopped.
        keep_localization: the operator's word that the robot is where it says: no fiducial is asked at the start.
        furniture_open: the operator's word that all closed furniture was opened before the run.
        start_within_m: distance from the surveyed start within which the robot is at it.
        margin_m: distance beyond a container's edge up to which a tag belongs to it.
    """

    speed_mps: float | None = None
    stop_within_m: float = 0.5
    sees_m: float = 3.0
    look_s: float = 6.0
    poll_s: float = 0.25
    outage_s: float = 3.0
    patience_s: float = 20.0
    walk_factor: float = 4.0
    attempts: int = 3
    retry_s: float = 5.0
    margin_m: float = 0.35
    start_within_m: float = 0.25
    keep_localization: bool = False
    furniture_open: bool = False
    resume: bool = False

    def hold_s(self, speed_mps: float) -> float:
        """How long a command to walk holds without being renewed, in seconds, at this speed limit."""
        return min(LONGEST_HOLD_S, HOLD_SHARE * self.stop_within_m / speed_mps)

    def check_hold(self, speed_mps: float) -> None:
        """Raise BadValue for a speed at which commands would have to be renewed faster than Wi-Fi allows."""
        if self.hold_s(speed_mps) < SHORTEST_HOLD_S:
            needed = SHORTEST_HOLD_S * speed_mps / HOLD_SHARE
            slower = HOLD_SHARE * self.stop_within_m / SHORTEST_HOLD_S
            wanted = f"at least {needed:.2f} m at {speed_mps:g} m/s; or limit the speed to {slower:.2f} m/s (--speed)"
            raise BadValue("--stop-within", self.stop_within_m, wanted)
