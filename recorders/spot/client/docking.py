"""Docking and undocking, as the SDK's blocking_dock_robot and blocking_undock do, by the session's clock."""

from __future__ import annotations

from bosdyn.api.docking import docking_pb2
from google.protobuf.timestamp_pb2 import Timestamp

from recorders.spot.client.connection import ROBOT_ERRORS, Connection, reason_of
from workbench.log_schema.events import NANO

DOCK_LIMIT_S, MARGIN_S, POLL_S = 30.0, 10.0, 1.0
DOCK_ATTEMPTS = 4
_Feedback = docking_pb2.DockingCommandFeedbackResponse


def docked_at(connection: Connection) -> int | None:
    """The number of the dock on which the robot stands; None if on none, or if its software knows no docks."""
    try:
        state: docking_pb2.DockState = connection.client("docking").get_docking_state(timeout=connection.timeout_s)
    except ROBOT_ERRORS:
        return None
    return state.dock_id if state.status == docking_pb2.DockState.DOCK_STATUS_DOCKED else None


def undock(connection: Connection) -> str:
    """Undock a robot that stands on its dock, its motors on; returns the reason of a failure, or ""."""
    ended = _dock_command(connection, 0, docking_pb2.PREP_POSE_UNDOCK)
    return "" if ended == _Feedback.STATUS_AT_PREP_POSE else _in_words(ended)


def dock(connection: Connection, number: int) -> str:
    """Dock a robot that stands in front of its dock; returns the reason of a failure, or ""."""
    ended: _Status = _Feedback.STATUS_UNKNOWN
    for attempt in range(DOCK_ATTEMPTS):
        posed = docking_pb2.PREP_POSE_SKIP_POSE if attempt % 2 else docking_pb2.PREP_POSE_USE_POSE
        ended = _dock_command(connection, number, posed)
        if ended == _Feedback.STATUS_DOCKED:
            return ""
        if ended not in (_Feedback.STATUS_MISALIGNED, _Feedback.STATUS_ERROR_COMMAND_TIMED_OUT):
            break
    return _in_words(ended)


_Status = docking_pb2.DockingCommandFeedbackResponse.Status.ValueType | str


def _dock_command(connection: Connection, number: int, posed: docking_pb2.PrepPoseBehavior.ValueType) -> _Status:
    """The status with which a docking command ended; words where it was refused."""
    client, clock = connection.client("docking"), connection.clock
    clock.refresh()
    sync = connection.robot.time_sync
    if sync is None:
        return "no time sync"
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
        return reason_of(error)
    return status


def _in_words(ended: _Status) -> str:
    if isinstance(ended, str):
        return ended
    return _Feedback.Status.Name(ended).removeprefix("STATUS_").removeprefix("ERROR_").lower().replace("_", " ")
