"""Is the robot localised, and at which waypoint? Read from GraphNav's answers, live or recorded."""

from __future__ import annotations

from math import hypot
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bosdyn.api.graph_nav import graph_nav_pb2

ON_WAYPOINT_M = 0.3
"""A robot within this distance stands on the waypoint."""


def is_localized(state: graph_nav_pb2.GetLocalizationStateResponse) -> bool:
    """Whether GraphNav knows where the robot is: a lost robot keeps the waypoint at which it was last sure."""
    return bool(state.localization.waypoint_id) and not state.lost_detector_state.is_lost


def waypoint_of(data: bytes) -> str:
    """The waypoint on which the robot stands, or "" when it stands on none, or without the Spot SDK.

    Args:
        data: a bosdyn.api.graph_nav.Localization as it came.
    """
    try:
        from bosdyn.api.graph_nav import nav_pb2
    except ImportError:
        return ""
    place = nav_pb2.Localization.FromString(data)
    at = place.waypoint_tform_body.position
    return place.waypoint_id if hypot(at.x, at.y) < ON_WAYPOINT_M else ""
