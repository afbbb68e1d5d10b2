"""At which waypoint was the robot localised? Read from a recorded GraphNav localisation."""

from __future__ import annotations

from math import hypot

ON_WAYPOINT_M = 0.3
"""A robot within this distance stands on the waypoint."""


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
