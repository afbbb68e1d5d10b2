"""Lookup of transforms in bosdyn frame trees that may be empty or invalid."""

from __future__ import annotations

from typing import cast

from bosdyn.api import geometry_pb2
from bosdyn.client.frame_helpers import Error as FrameTreeError
from bosdyn.client.frame_helpers import get_a_tform_b
from bosdyn.client.math_helpers import SE3Pose


def tform(snapshot: geometry_pb2.FrameTreeSnapshot, frame: str, other: str) -> SE3Pose | None:
    """frame_tform_other of a FrameTreeSnapshot; None if a frame is missing or the tree is invalid."""
    try:  # the SDK declares no type; a Vec3, which pyright infers as well, never comes out of it
        return cast("SE3Pose | None", get_a_tform_b(snapshot, frame, other))
    except FrameTreeError:
        return None
