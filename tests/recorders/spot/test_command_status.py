"""Commands that another one replaced are not waited for, and a blocked walk is not one that arrived."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import pytest
from bosdyn.api import basic_command_pb2, robot_command_pb2
from bosdyn.client.robot_command import RobotCommandBuilder, RobotCommandClient
from spot_help import robot

from recorders.spot.client.command_status import command_end
from recorders.spot.client.connection import Connection
from recorders.spot.client.control import Control
from recorders.spot.client.errors import NotReady

Status = basic_command_pb2.RobotCommandFeedbackStatus
Walk = basic_command_pb2.SE2TrajectoryCommand.Feedback


@pytest.mark.parametrize("status", Status.Status.values())
def test_only_commands_that_go_on_have_no_end(status: basic_command_pb2.RobotCommandFeedbackStatus.Status.ValueType):
    goes_on = status in (Status.STATUS_UNKNOWN, Status.STATUS_PROCESSING)
    assert (command_end(status) is None) == goes_on


def replaced_by_sitting(connection: Connection, monkeypatch: pytest.MonkeyPatch) -> None:
    """From now on somebody lets the robot sit down, by the same lease, right after each of our commands."""
    send: Callable[..., Any] = RobotCommandClient.robot_command

    def and_sit(self: RobotCommandClient, command: robot_command_pb2.RobotCommand, **options: Any) -> Any:
        number = send(self, command, **options)
        send(self, RobotCommandBuilder.synchro_sit_command())
        return number

    monkeypatch.setattr(RobotCommandClient, "robot_command", and_sit)


def test_standing_up_is_not_waited_for_once_another_command_has_replaced_it(monkeypatch: pytest.MonkeyPatch) -> None:
    with robot() as (_spot, connection):
        replaced_by_sitting(connection, monkeypatch)
        with (
            pytest.raises(NotReady, match="did not stand up: the command ended with command_overridden"),
            Control(connection, own_estop=True),
        ):
            pass


def test_neither_is_sitting_down(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    with robot() as (spot, connection), caplog.at_level(logging.WARNING, "lios.spot"):
        with Control(connection, own_estop=True):
            replaced_by_sitting(connection, monkeypatch)
        assert "does not sit down: the command ended with command_overridden" in caplog.text
        assert spot.state.leases.owner is None


def test_a_walk_that_an_obstacle_stops_says_that_its_goal_is_blocked() -> None:
    found: dict[bool, tuple[int, int]] = {}
    for blocked in (False, True):
        with robot() as (spot, connection), Control(connection, own_estop=True):
            spot.state.localized, spot.state.body.stuck = True, blocked
            client, clock = connection.client("robot-command"), connection.clock
            clock.refresh()
            walk = RobotCommandBuilder.synchro_se2_trajectory_point_command(0.4, 0.0, 0.0, "body")
            number = client.robot_command(walk)
            clock.sleep(5.0)
            answer = client.robot_command_feedback(number).feedback.synchronized_feedback.mobility_command_feedback
            walked = answer.se2_trajectory_feedback
            found[blocked] = walked.status, walked.final_goal_status
    assert found[False] == (Walk.STATUS_STOPPED, Walk.FINAL_GOAL_STATUS_ACHIEVABLE)
    assert found[True] == (Walk.STATUS_STOPPED, Walk.FINAL_GOAL_STATUS_BLOCKED)
