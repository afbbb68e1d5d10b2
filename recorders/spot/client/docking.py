"""Docking and undocking, as the SDK's blocking_dock_robot and blocking_undock do, by the session's clock."""

from __future__ import annotations

from bosdyn.api.docking import docking_pb2
from google.protobuf.timestamp_pb2 import Timestamp

from recorders.spot.client.connection import ROBOT_ERRORS, Connection, reason_of
from workbench.log_schema.events import NANO
from workbench.message_enum import MessageEnum, Result

DOCK_LIMIT_S, MARGIN_S, POLL_S = 30.0, 10.0, 1.0
PREP_POSES = 2 * (docking_pb2.PREP_POSE_USE_POSE, docking_pb2.PREP_POSE_SKIP_POSE)
"""The preparations of one attempt after the other."""
_Feedback = docking_pb2.DockingCommandFeedbackResponse


class DockOutcome(MessageEnum):
    """How docking or undocking ended; MISSED may succeed when it is tried again."""

    DONE = ""
    NO_TIME_SYNC = "no time sync"
    REFUSED = "{reason}"
    MISSED = "{status}"
    FAILED = "{end}"


def docked_at(connection: Connection) -> int | None:
    """The number of the dock on which the robot stands; None if on none, or if its software knows no docks."""
    try:
        state: docking_pb2.DockState = connection.client("docking").get_docking_state(timeout=connection.timeout_s)
    except ROBOT_ERRORS:
        return None
    return state.dock_id if state.status == docking_pb2.DockState.DOCK_STATUS_DOCKED else None


def undock(connection: Connection) -> Result[DockOutcome]:
    """Undock a robot that stands on its dock, its motors on."""
    return _dock_command(connection, 0, docking_pb2.PREP_POSE_UNDOCK, goal=_Feedback.STATUS_AT_PREP_POSE)


def dock(connection: Connection, number: int) -> Result[DockOutcome]:
    """Dock a robot that stands in front of its dock, if need be in several attempts."""
    for posed in PREP_POSES[:-1]:
        ended = _dock_command(connection, number, posed, goal=_Feedback.STATUS_DOCKED)
        if ended.kind is not DockOutcome.MISSED:
            return ended
    return _dock_command(connection, number, PREP_POSES[-1], goal=_Feedback.STATUS_DOCKED)


def _dock_command(
    connection: Connection,
    number: int,
    posed: docking_pb2.PrepPoseBehavior.ValueType,
    *,
    goal: docking_pb2.DockingCommandFeedbackResponse.Status.ValueType,
) -> Result[DockOutcome]:
    """How a docking command ended.

    Args:
        goal: the status with which it is done.
    """
    client, clock = connection.client("docking"), connection.clock
    clock.refresh()
    sync = connection.robot.time_sync
    if sync is None:
        return DockOutcome.NO_TIME_SYNC.result()
    ends_ns = clock.now_ns() + clock.skew_ns() + round(DOCK_LIMIT_S * NANO)
    limit_ns = clock.now_ns() + round((DOCK_LIMIT_S + MARGIN_S) * NANO)
    try:
        command: int = client.docking_command(
            number,
            sync.endpoint.clock_identifier,
            Timestamp(seconds=ends_ns // NANO, nanos=ends_ns % NANO),
            posed,
            timeout=connection.timeout_s,
        )
        status = _Feedback.STATUS_IN_PROGRESS
        while status == _Feedback.STATUS_IN_PROGRESS and clock.now_ns() < limit_ns:
            clock.sleep(POLL_S)
            status = client.docking_command_feedback_full(command, timeout=connection.timeout_s).status
    except ROBOT_ERRORS as error:
        return DockOutcome.REFUSED.result(reason=reason_of(error))
    if status == goal:
        return DockOutcome.DONE.result()
    words = _Feedback.Status.Name(status).removeprefix("STATUS_").removeprefix("ERROR_").lower().replace("_", " ")
    missed = status in (_Feedback.STATUS_MISALIGNED, _Feedback.STATUS_ERROR_COMMAND_TIMED_OUT)
    return DockOutcome.MISSED.result(status=words) if missed else DockOutcome.FAILED.result(end=words)
