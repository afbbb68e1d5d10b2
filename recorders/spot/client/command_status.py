"""Whether a command to Spot still goes on: replaced, expired and dropped commands never come to their goal.

The SDK's own waits do not ask (findings/bosdyn-blocking-waits.sh).
"""

from __future__ import annotations

from bosdyn.api import basic_command_pb2

_Status = basic_command_pb2.RobotCommandFeedbackStatus


def command_end(status: basic_command_pb2.RobotCommandFeedbackStatus.Status.ValueType) -> str | None:
    """How a command ended without coming to its goal, in the robot's words; None while it goes on."""
    if status in (_Status.STATUS_PROCESSING, _Status.STATUS_UNKNOWN):
        return None
    return _Status.Status.Name(status).removeprefix("STATUS_").lower()
