"""The localisation state and current waypoint of a robot, from live or recorded GraphNav messages."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bosdyn.api.graph_nav import graph_nav_pb2

ON_WAYPOINT_M = 0.3
"""A robot within this many metres of a waypoint is at it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Localization:
    """Where a robot was localised.

    Attributes:
        tag: the nearest fiducial then in view that is no item's; None if none was.
        age_s: age in seconds of the robot's localisation when it was asked for.
        kept: whether the robot's own localisation was trusted, and no fiducial was asked.
    """

    waypoint: str
    tag: int | None
    age_s: float
    kept: bool = False

    def facts(self) -> dict[str, object]:
        """What a log's settings say of it."""
        facts: dict[str, object] = {"waypoint": self.waypoint, "tag": self.tag, "age_s": self.age_s}
        return {**facts, "kept": True} if self.kept else facts

    def in_words(self) -> str:
        if self.kept:
            return f"at {self.waypoint} as it says itself, {self.age_s:.1f} s old; no fiducial was asked"
        by = "by a fiducial" if self.tag is None else f"by fiducial {self.tag}"
        return f"at {self.waypoint} {by}, {self.age_s:.1f} s old"


def is_localized(state: graph_nav_pb2.GetLocalizationStateResponse) -> bool:
    """Whether the robot is localised: a lost robot still reports its last waypoint."""
    return bool(state.localization.waypoint_id) and not state.lost_detector_state.is_lost


def waypoint_of(data: bytes) -> str | None:
    """The id of the waypoint at which the robot is; None if it is at none, or without the Spot SDK.

    Args:
        data: a serialised bosdyn.api.graph_nav.Localization.
    """
    try:
        from bosdyn.api.graph_nav import nav_pb2
    except ImportError:
        return None
    place = nav_pb2.Localization.FromString(data)
    at = place.waypoint_tform_body.position
    return place.waypoint_id if hypot(at.x, at.y) < ON_WAYPOINT_M else None
