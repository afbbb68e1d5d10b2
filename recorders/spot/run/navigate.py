"""Walking to a location with GraphNav. Commands are renewed continually, so that an unreachable robot stops by
itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from math import hypot
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeAlias

from bosdyn.api import geometry_pb2
from bosdyn.api.graph_nav import graph_nav_pb2
from bosdyn.client.exceptions import ResponseError, UnsetStatusError
from bosdyn.client.graph_nav import CommandExpiredError, GraphNavClient, RobotImpairedError, UnrecongizedCommandError

from recorders.spot.client.connection import reason_of
from recorders.spot.client.errors import RunStopped
from recorders.spot.client.odometer import WalkLog
from recorders.spot.client.seed_frame import in_seed
from recorders.spot.run.operator_requests import SKIPPED
from workbench.worlds.geometry import Pose
from workbench.worlds.house import LocationId

if TYPE_CHECKING:
    from recorders.spot.run.world import SpotWorld

_Status: TypeAlias = "graph_nav_pb2.NavigationFeedbackResponse.Status.ValueType"
_Feedback = graph_nav_pb2.NavigationFeedbackResponse
_Goal = Callable[[int | None], int]
"""Sends a navigation command, new or renewing the one with this id; returns the id."""

TURN_LIMIT = 1.0
"""Angular speed limit in radians per second."""
RENEWALS = 4
"""How often a command to walk is renewed while it holds, if the network is fast enough."""
MIN_TIME_LIMIT_S = 20.0
"""Time allowance in seconds of every walk, added to walk_factor times its expected time."""
UNKNOWN_M = 20.0
"""Assumed walking distance in metres of a robot that is not localised."""
LEASE_LOST = "the lease was lost: another client commands the robot"
IMPAIRED = "the robot is impaired: stopped, or its motors are off"


class WalkEnding(StrEnum):
    """What the end of a walk means for the run.

    Attributes:
        GOING: it has not ended. TIMED_OUT: the robot stands, since no command was renewed in time.
        SAW_ITEM: the robot stands, since it has seen an item that it looks for.
        TRY_AGAIN: somebody or something is in the way, and may step aside.
        LOCALIZE: the robot does not know where it is; it walks again only once it was localised.
        REFUSED: it will not get there, however often it tries.
        STOPS_RUN: somebody else has the robot, or it cannot move.
    """

    GOING = "going"
    TIMED_OUT = "timed-out"
    ARRIVED = "arrived"
    SAW_ITEM = "saw-item"
    TRY_AGAIN = "try-again"
    LOCALIZE = "localize"
    REFUSED = "refused"
    STOPS_RUN = "stops-run"


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkEnd:
    """How a walk ended, and why, in words; "" on arrival."""

    ending: WalkEnding
    reason: str = ""


def walk(world: SpotWorld, location: LocationId, walked: WalkLog, *, stand: Pose | None = None) -> WalkEnd:
    """Walk once. If it does not arrive, the robot has been commanded to stop.

    Args:
        walked: records the robot's positions.
        stand: another pose at the location than the one at which it is used.

    Raises:
        RunStopped: the run cannot continue: stop, lost lease, impaired robot, or network down.
    """
    settings = world.settings
    hold_s = hold_of(world)
    pose = stand or world.site.paths.standing_pose(location)
    if pose is None:
        return WalkEnd(ending=WalkEnding.REFUSED, reason=f"no way leads to {location}")
    _note_place(world, walked)
    limit_ns = world.now_ns() + round((MIN_TIME_LIMIT_S + settings.walk_factor * _expected_s(world, pose)) * 1e9)
    goal, number, sent_ns = navigation_goal(world, location, pose), None, 0
    status, ending = _Feedback.STATUS_FOLLOWING_ROUTE, WalkEnding.GOING
    while ending in (WalkEnding.GOING, WalkEnding.TIMED_OUT):
        if world.now_ns() > limit_ns:
            world.control.stop()
            return WalkEnd(ending=WalkEnding.TRY_AGAIN, reason="navigation took too long")
        try:
            if ending is WalkEnding.TIMED_OUT:
                world.go_on_after("it got no command in time, and stands")
                number = None
            if number is None or world.now_ns() - sent_ns >= hold_s / RENEWALS * 1e9:
                number, sent_ns = renew_navigation(world, goal, number), world.now_ns()
            world.wait(min(settings.poll_s, hold_s / RENEWALS))
            if world.requests.take_skip():
                world.control.stop()
                return WalkEnd(ending=WalkEnding.REFUSED, reason=SKIPPED)
            if world.requests.paused:
                limit_ns, number, ending = limit_ns + _stand_while_paused(world), None, WalkEnding.GOING
                continue
            status = _status(world, number)
            world.check_battery()
            if world.hands.check_holding():
                number = None
            if world.watch is not None and ENDINGS.get(status) is WalkEnding.GOING and world.watch.stops():
                world.control.stop()
                _note_place(world, walked)
                return WalkEnd(ending=WalkEnding.SAW_ITEM)
        except RobotImpairedError as error:
            raise RunStopped(IMPAIRED) from error
        except ResponseError as error:
            world.control.stop()
            return WalkEnd(ending=WalkEnding.TRY_AGAIN, reason=f"the robot refuses to go ({reason_of(error)})")
        ending = ENDINGS.get(status, WalkEnding.REFUSED)
        _note_place(world, walked)
    if ending is not WalkEnding.ARRIVED:
        world.control.stop()
    return _how_it_ended(status, ending)


def _stand_while_paused(world: SpotWorld) -> int:
    """Stop the robot until the operator lets it go on; returns for how long it stood, in nanoseconds.

    Raises:
        RunStopped: as for every wait.
    """
    began_ns = world.now_ns()
    world.control.stop()
    world.tell("Paused by the operator")
    while world.requests.paused:
        world.wait(world.settings.poll_s)
    world.tell("The operator lets the robot go on")
    return world.now_ns() - began_ns


def _how_it_ended(status: _Status, ending: WalkEnding) -> WalkEnd:
    if ending is WalkEnding.ARRIVED:
        return WalkEnd(ending=ending)
    if status in _IN_WORDS:
        reason = _IN_WORDS[status]
    elif status in _Feedback.Status.values():
        reason = f"navigation ended with {_Feedback.Status.Name(status).removeprefix('STATUS_').lower()}"
    else:
        reason = f"navigation ended with a status that this client does not know ({status})"
    if ending is WalkEnding.STOPS_RUN:
        raise RunStopped(reason)
    return WalkEnd(ending=ending, reason=reason)


def _status(world: SpotWorld, number: int) -> _Status:
    timeout_s = world.connection.timeout_s
    try:
        answer: graph_nav_pb2.NavigationFeedbackResponse = world.call(
            lambda: world.graph_nav().navigation_feedback(number, timeout=timeout_s)
        )
    except UnsetStatusError:  # the SDK raises it for STATUS_UNKNOWN
        return _Feedback.STATUS_UNKNOWN
    return answer.status


def renew_navigation(world: SpotWorld, goal: _Goal, number: int | None) -> int:
    """Let the command to walk to a goal hold anew; returns the command id, a new one if the robot has lost the old.

    Without renewed commands the robot stops by itself, whatever the cause.

    Raises:
        RunStopped: the command ran out meanwhile, and nobody says that the robot may walk on.
    """
    world.connection.clock.refresh()
    try:
        return world.call(lambda: goal(number))
    except (UnrecongizedCommandError, CommandExpiredError):
        if number is not None:
            world.go_on_after("its command ran out, and it stands")
        world.connection.clock.refresh()
        return world.call(lambda: goal(None))


def _note_place(world: SpotWorld, walked: WalkLog) -> None:
    body = world.body_pose()
    if body is not None:
        walked.add((body.position.x, body.position.y))


def navigation_goal(world: SpotWorld, location: LocationId, pose: Pose) -> _Goal:
    """The goal for GraphNav: a waypoint, else a pose in the seed frame at body height."""
    client, timeout_s, lasts_s = world.graph_nav(), world.connection.timeout_s, hold_of(world)
    travel = GraphNavClient.generate_travel_params(0.25, 0.2, speed_limit(speed_of(world)))
    waypoint = world.site.waypoints.get(location)
    if waypoint and pose == world.site.paths.standing_pose(location):
        return lambda number: client.navigate_to(
            waypoint, lasts_s, travel_params=travel, command_id=number, timeout=timeout_s
        )
    place = in_seed(world.site, pose)
    state: graph_nav_pb2.GetLocalizationStateResponse = world.call(
        lambda: client.get_localization_state(timeout=timeout_s)
    )
    place.position.z = state.localization.seed_tform_body.position.z
    return lambda number: client.navigate_to_anchor(
        place, lasts_s, travel_params=travel, command_id=number, timeout=timeout_s
    )


def _expected_s(world: SpotWorld, goal: Pose) -> float:
    body = world.body_pose()
    away_m = UNKNOWN_M if body is None else 2 * hypot(body.position.x - goal.x_m, body.position.y - goal.y_m)
    return away_m / speed_of(world)


def speed_of(world: SpotWorld) -> float:
    """The speed limit in m/s that is sent with every command: that of the run, else the site's."""
    return world.settings.speed_mps or world.site.robot.speed_mps


def hold_of(world: SpotWorld) -> float:
    """How long a command to walk holds without being renewed, in seconds.

    Boston Dynamics' own example sends commands that hold for 1 s, twice a second, so that they end soon when the
    program is killed (spot-sdk, graph_nav_command_line.py); with its id a command is continued, not begun anew
    (graph_nav.proto, NavigateToRequest.command_id).
    """
    return world.settings.hold_s(speed_of(world))


def speed_limit(speed_mps: float) -> geometry_pb2.SE2VelocityLimit:
    """A speed limit in every direction."""
    top = geometry_pb2.SE2Velocity(linear=geometry_pb2.Vec2(x=speed_mps, y=speed_mps), angular=TURN_LIMIT)
    least = geometry_pb2.SE2Velocity(linear=geometry_pb2.Vec2(x=-speed_mps, y=-speed_mps), angular=-TURN_LIMIT)
    return geometry_pb2.SE2VelocityLimit(max_vel=top, min_vel=least)


ENDINGS: Mapping[_Status, WalkEnding] = MappingProxyType(
    {
        _Feedback.STATUS_FOLLOWING_ROUTE: WalkEnding.GOING,
        _Feedback.STATUS_COMMAND_TIMED_OUT: WalkEnding.TIMED_OUT,
        _Feedback.STATUS_REACHED_GOAL: WalkEnding.ARRIVED,
        _Feedback.STATUS_STUCK: WalkEnding.TRY_AGAIN,
        _Feedback.STATUS_LOST: WalkEnding.LOCALIZE,
        _Feedback.STATUS_NO_LOCALIZATION: WalkEnding.LOCALIZE,
        _Feedback.STATUS_NOT_LOCALIZED_TO_ROUTE: WalkEnding.LOCALIZE,
        _Feedback.STATUS_NO_ROUTE: WalkEnding.REFUSED,
        _Feedback.STATUS_CONSTRAINT_FAULT: WalkEnding.REFUSED,
        _Feedback.STATUS_AREA_CALLBACK_ERROR: WalkEnding.REFUSED,
        _Feedback.STATUS_UNKNOWN: WalkEnding.REFUSED,
        _Feedback.STATUS_ROBOT_IMPAIRED: WalkEnding.STOPS_RUN,
        _Feedback.STATUS_COMMAND_OVERRIDDEN: WalkEnding.STOPS_RUN,
        _Feedback.STATUS_LEASE_ERROR: WalkEnding.STOPS_RUN,
    }
)
"""Every feedback status of navigate_to (graph_nav.proto, NavigationFeedbackResponse); others are refused."""
_IN_WORDS: Mapping[_Status, str] = {
    _Feedback.STATUS_LEASE_ERROR: LEASE_LOST,
    _Feedback.STATUS_ROBOT_IMPAIRED: IMPAIRED,
    _Feedback.STATUS_COMMAND_OVERRIDDEN: "somebody else commands the robot: its walk was overridden",
    _Feedback.STATUS_AREA_CALLBACK_ERROR: "a region of the map (stairs, door, crossing) did not let it pass",
}
