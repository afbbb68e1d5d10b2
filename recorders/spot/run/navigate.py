"""Walking to a location with GraphNav. Commands are renewed continually, so that an unreachable robot stops by
itself."""

from __future__ import annotations

from collections.abc import Callable
from math import hypot
from typing import TYPE_CHECKING, TypeAlias

from bosdyn.api import geometry_pb2
from bosdyn.api.graph_nav import graph_nav_pb2
from bosdyn.client.exceptions import ResponseError
from bosdyn.client.graph_nav import CommandExpiredError, GraphNavClient, RobotImpairedError, UnrecongizedCommandError

from recorders.spot.client.connection import reason_of
from recorders.spot.client.errors import RunStopped
from recorders.spot.client.odometer import WalkLog
from recorders.spot.client.seed_frame import in_seed
from workbench.worlds.geometry import Pose
from workbench.worlds.house import LocationId

if TYPE_CHECKING:
    from recorders.spot.run.world import SpotWorld

_Status: TypeAlias = "graph_nav_pb2.NavigationFeedbackResponse.Status.ValueType"
_Goal = Callable[[int | None], int]
"""Sends a navigation command, new or renewing the one with this id; returns the id."""

TURN_LIMIT = 1.0
"""Angular speed limit in radians per second."""
MIN_TIME_LIMIT_S = 20.0
"""Time allowance in seconds of every walk, added to walk_factor times its expected time."""
UNKNOWN_M = 20.0
"""Assumed walking distance in metres of a robot that is not localised."""
LEASE_LOST = "the lease was lost: another client commands the robot"
IMPAIRED = "the robot is impaired: stopped, or its motors are off"


def walk(world: SpotWorld, location: LocationId, walked: WalkLog) -> str:
    """Walk once; returns "" on arrival, else the reason of the failure.

    Args:
        walked: records the robot's positions.

    Raises:
        RunStopped: the run cannot continue: stop, lost lease, impaired robot, or network down.
    """
    answer, settings = graph_nav_pb2.NavigationFeedbackResponse, world.settings
    pose = world.site.paths.standing_pose(location)
    if pose is None:
        return f"no way leads to {location}"
    _note_place(world, walked)
    limit_ns = world.now_ns() + round((MIN_TIME_LIMIT_S + settings.walk_factor * _expected_s(world, pose)) * 1e9)
    goal, number, sent_ns = navigation_goal(world, location, pose), None, 0
    status = answer.STATUS_FOLLOWING_ROUTE
    while status in _GOING:
        if world.now_ns() > limit_ns:
            world.control.stop()
            return "navigation took too long"
        try:
            if status == answer.STATUS_COMMAND_TIMED_OUT:
                number = None
            if number is None or world.now_ns() - sent_ns > settings.dead_man_s / 3 * 1e9:
                number, sent_ns = renew_navigation(world, goal, number), world.now_ns()
            world.wait(settings.poll_s)
            status = _status(world, number)
        except RobotImpairedError as error:
            raise RunStopped(IMPAIRED) from error
        except ResponseError as error:
            return f"the robot refuses to go ({reason_of(error)})"
        _note_place(world, walked)
    if status != answer.STATUS_REACHED_GOAL:
        world.control.stop()
    return _how_it_ended(status)


def _how_it_ended(status: _Status) -> str:
    answer = graph_nav_pb2.NavigationFeedbackResponse
    if status == answer.STATUS_LEASE_ERROR:
        raise RunStopped(LEASE_LOST)
    if status == answer.STATUS_ROBOT_IMPAIRED:
        raise RunStopped(IMPAIRED)
    if status == answer.STATUS_REACHED_GOAL:
        return ""
    return f"navigation ended with {answer.Status.Name(status).removeprefix('STATUS_').lower()}"


def _status(world: SpotWorld, number: int) -> _Status:
    timeout_s = world.connection.timeout_s
    answer: graph_nav_pb2.NavigationFeedbackResponse = world.call(
        lambda: world.graph_nav().navigation_feedback(number, timeout=timeout_s)
    )
    return answer.status


def renew_navigation(world: SpotWorld, goal: _Goal, number: int | None) -> int:
    """Extend the command to walk to a goal by dead_man_s; returns the command id, a new one if the robot has lost
    the old.

    Without renewed commands the robot stops by itself, whatever the cause.
    """
    world.connection.clock.refresh()
    try:
        return world.call(lambda: goal(number))
    except (UnrecongizedCommandError, CommandExpiredError):
        world.connection.clock.refresh()
        return world.call(lambda: goal(None))


def _note_place(world: SpotWorld, walked: WalkLog) -> None:
    body = world.body_pose()
    if body is not None:
        walked.add((body.position.x, body.position.y))


def navigation_goal(world: SpotWorld, location: LocationId, pose: Pose) -> _Goal:
    """The goal for GraphNav: a waypoint, else a pose in the seed frame at body height."""
    client, timeout_s, lasts_s = world.graph_nav(), world.connection.timeout_s, world.settings.dead_man_s
    travel = GraphNavClient.generate_travel_params(0.25, 0.2, speed_limit(speed_of(world)))
    waypoint = world.site.waypoints.get(location)
    if waypoint:
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


def speed_limit(speed_mps: float) -> geometry_pb2.SE2VelocityLimit:
    """A speed limit in every direction."""
    top = geometry_pb2.SE2Velocity(linear=geometry_pb2.Vec2(x=speed_mps, y=speed_mps), angular=TURN_LIMIT)
    least = geometry_pb2.SE2Velocity(linear=geometry_pb2.Vec2(x=-speed_mps, y=-speed_mps), angular=-TURN_LIMIT)
    return geometry_pb2.SE2VelocityLimit(max_vel=top, min_vel=least)


_GOING = (
    graph_nav_pb2.NavigationFeedbackResponse.STATUS_FOLLOWING_ROUTE,
    graph_nav_pb2.NavigationFeedbackResponse.STATUS_UNKNOWN,
    graph_nav_pb2.NavigationFeedbackResponse.STATUS_COMMAND_TIMED_OUT,
)
"""A command that timed out because we were disconnected is sent again."""
