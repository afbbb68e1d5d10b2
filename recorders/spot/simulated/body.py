"""The body of the simulated robot: walking along paths at Spot's speed, turning, sitting, standing, battery and
odometry.

Positions are in the map frame; odometry is dead reckoning with the small errors of a legged robot, so that odom and
vision drift relative to the map as on a real robot and only localisation relates them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from itertools import pairwise
from math import atan2, cos, hypot, pi, sin

from workbench.tolerances import MIN_ANGLE_RAD, MIN_LENGTH_M, MIN_STEP_S, ROUNDING
from workbench.worlds.geometry import Point, Pose

STEP_S = 0.05
TURN_RATE = 1.2
"""Turning speed on the spot in radians per second."""
TURN_FIRST_RAD = 0.6
"""Corners sharper than this angle are turned on the spot, others while walking."""
STAND_S, SIT_S, POWER_ON_S = 1.5, 1.5, 2.0
TOP_SPEED_MPS = 1.6
"""Spot's own speed limit (Boston Dynamics), used unless a command has a lower one."""
BATTERY_S = 90 * 60.0
"""Spot's typical run time (90 minutes, Boston Dynamics)."""


class Motors(StrEnum):
    """The state of the motors' power."""

    OFF = "off"
    POWERING_ON = "powering-on"
    ON = "on"


class WalkState(StrEnum):
    """How a walk goes, or how it ended."""

    WALKING = "walking"
    ARRIVED = "arrived"
    STUCK = "stuck"
    LOST = "lost"
    STOPPED = "stopped"
    EXPIRED = "expired"
    NO_LEASE = "no-lease"
    IMPAIRED = "impaired"


@dataclass(slots=True)
class BodyWalk:
    """A walk in progress."""

    number: int
    corners: list[Point]
    final_yaw_rad: float | None
    speed_mps: float
    end_s: float
    state: WalkState = WalkState.WALKING

    def left_m(self, at: Point) -> float:
        points = [at, *self.corners]
        return sum(hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(points))


@dataclass(slots=True)
class DeadReckoning:
    """Odometry: the pose by dead reckoning."""

    length_error: float
    turn_error: float
    x_m: float = 0.0
    y_m: float = 0.0
    yaw_rad: float = 0.0
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of the body over the last step, in this frame: m/s along x and y, and rad/s."""

    def since(self, was: tuple[float, float, float], step_s: float) -> None:
        """Take the velocity from the pose before the step."""
        x_m, y_m, yaw_rad = was
        moved = (self.x_m - x_m, self.y_m - y_m, wrapped(self.yaw_rad - yaw_rad))
        self.velocity = (moved[0] / step_s, moved[1] / step_s, moved[2] / step_s)

    def add(self, forward_m: float, left_m: float, turn_rad: float) -> None:
        c, s = cos(self.yaw_rad), sin(self.yaw_rad)
        forward_m, left_m = forward_m * (1 + self.length_error), left_m * (1 + self.length_error)
        self.x_m += c * forward_m - s * left_m
        self.y_m += s * forward_m + c * left_m
        self.yaw_rad = wrapped(self.yaw_rad + turn_rad * (1 + self.turn_error))


@dataclass(slots=True)
class Body:
    """The state of the body, advanced by `live_until`."""

    pose: Pose
    speed_mps: float
    lived_s: float = 0.0
    motors: Motors = Motors.OFF
    powered_at_s: float = 0.0
    standing: bool = False
    posture_at_s: float = 0.0
    stuck: bool = False
    walk: BodyWalk | None = None
    battery: float = 0.93
    odom: DeadReckoning = field(default_factory=lambda: DeadReckoning(0.004, 0.003))
    vision: DeadReckoning = field(default_factory=lambda: DeadReckoning(0.001, 0.0005))
    walked_m: float = 0.0

    def advance_to(self, body_s: float) -> None:
        """Simulate until this body time in seconds."""
        while self.lived_s < body_s - ROUNDING:
            step = min(STEP_S, body_s - self.lived_s)
            self.lived_s += step
            if self.motors is Motors.POWERING_ON and self.lived_s - self.powered_at_s >= POWER_ON_S:
                self.motors = Motors.ON
            self.battery = max(0.0, self.battery - step / BATTERY_S * (1.0 if self.motors is Motors.ON else 0.15))
            was = [(reckoned.x_m, reckoned.y_m, reckoned.yaw_rad) for reckoned in (self.odom, self.vision)]
            if self.walk is not None and self.walk.state is WalkState.WALKING:
                self._step(self.walk, step)
            for reckoned, before in zip((self.odom, self.vision), was, strict=True):
                reckoned.since(before, step)

    def power_on(self) -> None:
        if self.motors is Motors.OFF:
            self.motors, self.powered_at_s = Motors.POWERING_ON, self.lived_s

    def power_off(self) -> None:
        self.motors, self.standing = Motors.OFF, False
        self.halt(WalkState.IMPAIRED)

    def stand(self, up: bool) -> None:
        if self.standing is not up:
            self.standing, self.posture_at_s = up, self.lived_s

    @property
    def settled(self) -> bool:
        """Whether standing up or sitting down is finished."""
        return self.lived_s - self.posture_at_s >= (STAND_S if self.standing else SIT_S)

    def go(self, walk: BodyWalk) -> None:
        self.halt(WalkState.STOPPED)
        self.stand(True)
        self.walk = walk

    def halt(self, state: WalkState) -> None:
        """End the current walk with the given state."""
        if self.walk is not None and self.walk.state is WalkState.WALKING:
            self.walk.state = state

    def _step(self, walk: BodyWalk, step: float) -> None:
        if self.lived_s > walk.end_s:
            walk.state = WalkState.EXPIRED
            return
        if self.motors is not Motors.ON:
            walk.state = WalkState.IMPAIRED
            return
        if not self.settled:
            return
        if self.stuck:
            walk.state = WalkState.STUCK
            return
        left = step
        while left > ROUNDING and walk.state is WalkState.WALKING:
            left = self._towards(walk, left) if walk.corners else self._face(walk, left)

    def _towards(self, walk: BodyWalk, left: float) -> float:
        x, y = walk.corners[0]
        dx, dy = x - self.pose.x_m, y - self.pose.y_m
        far = hypot(dx, dy)
        if far < MIN_LENGTH_M:
            walk.corners.pop(0)
            return left
        turn = wrapped(atan2(dy, dx) - self.pose.yaw_rad)
        if abs(turn) > TURN_FIRST_RAD and far > 0.1:
            took = min(left, (abs(turn) - TURN_FIRST_RAD / 2) / TURN_RATE)
            self._move(0.0, 0.0, (1 if turn > 0 else -1) * TURN_RATE * took)
            return left - took
        gone = min(far, walk.speed_mps * left)
        turned = max(-TURN_RATE * left, min(TURN_RATE * left, turn if far > 0.1 else 0.0))
        self._move(dx / far * gone, dy / far * gone, turned)
        if gone >= far - ROUNDING:
            walk.corners.pop(0)
        return left - gone / walk.speed_mps

    def _face(self, walk: BodyWalk, left: float) -> float:
        turn = 0.0 if walk.final_yaw_rad is None else wrapped(walk.final_yaw_rad - self.pose.yaw_rad)
        took = min(left, abs(turn) / TURN_RATE)
        self._move(0.0, 0.0, (1 if turn > 0 else -1) * TURN_RATE * took)
        if abs(turn) - TURN_RATE * took < MIN_ANGLE_RAD:
            walk.state = WalkState.ARRIVED
        return left - max(took, MIN_STEP_S)

    def _move(self, dx: float, dy: float, turn: float) -> None:
        """Move by a vector in the map frame and turn."""
        c, s = cos(self.pose.yaw_rad), sin(self.pose.yaw_rad)
        forward, left = c * dx + s * dy, -s * dx + c * dy
        self.odom.add(forward, left, turn)
        self.vision.add(forward, left, turn)
        self.walked_m += hypot(dx, dy)
        self.pose = Pose(x_m=self.pose.x_m + dx, y_m=self.pose.y_m + dy, yaw_rad=wrapped(self.pose.yaw_rad + turn))


def wrapped(angle: float) -> float:
    """The angle normalised to (-pi, pi]."""
    return pi - (pi - angle) % (2 * pi)
