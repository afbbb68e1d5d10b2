"""The settings of motion and perception of a run on a robot."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSettings:
    """Settings of motion and perception.

    Attributes:
        speed_mps: speed limit of walking; None for the site's.
        look_s: duration of a look, within which tags must be seen.
        poll_s: polling interval.
        dead_man_s: time for which the robot walks on without a renewed command.
        patience_s: network outage after which the run ends.
        walk_factor: time limit of a walk as a multiple of its expected time.
        attempts, retry_s: number of attempts of a blocked or lost walk, and the pause between them, since
            people step aside.
        resume: whether the robot goes on by itself after an outage in which it stopped.
        furniture_open: the operator's word that all closed furniture was opened before the run.
        start_within_m: distance from the surveyed start within which the robot is at it.
        margin_m: distance beyond a container's edge up to which a tag belongs to it.
    """

    speed_mps: float | None = None
    look_s: float = 6.0
    poll_s: float = 0.25
    dead_man_s: float = 3.0
    patience_s: float = 20.0
    walk_factor: float = 4.0
    attempts: int = 3
    retry_s: float = 5.0
    margin_m: float = 0.35
    start_within_m: float = 0.25
    furniture_open: bool = False
    resume: bool = False
