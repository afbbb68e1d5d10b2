"""The robot's battery and its limits for a run."""

from __future__ import annotations

from bosdyn.api import robot_state_pb2

START_PERCENT, STOP_PERCENT = 30.0, 15.0
"""A run begins with at least START_PERCENT of charge, and ends in an orderly way below STOP_PERCENT."""


def charge_percent(state: robot_state_pb2.RobotState) -> float | None:
    """The charge in percent, 0 to 100; None where the robot does not report one."""
    power = state.power_state
    if power.HasField("locomotion_charge_percentage"):
        return power.locomotion_charge_percentage.value
    known = [pack.charge_percentage.value for pack in state.battery_states if pack.HasField("charge_percentage")]
    return min(known, default=None)


def left_minutes(state: robot_state_pb2.RobotState) -> float | None:
    """The robot's own estimate of the time left in minutes; None where it gives none."""
    power = state.power_state
    return power.locomotion_estimated_runtime.seconds / 60 if power.HasField("locomotion_estimated_runtime") else None
