"""Fiducial tags from the robot's world objects, with positions on the map."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import cos, sin

from bosdyn.api import geometry_pb2, world_object_pb2
from bosdyn.client.frame_helpers import BODY_FRAME_NAME, ODOM_FRAME_NAME, VISION_FRAME_NAME
from bosdyn.client.math_helpers import SE3Pose

from recorders.spot.client.clock import SessionClock
from recorders.spot.client.frame_trees import tform
from workbench.log_schema.events import NANO
from workbench.worlds.house import Container

Position = tuple[float, float, float]
REACH_UP_M = 0.8
"""A tag up to this many metres above a container's top is on it."""
_UNSURE = (
    world_object_pb2.AprilTagProperties.STATUS_AMBIGUOUS,
    world_object_pb2.AprilTagProperties.STATUS_HIGH_ERROR,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class TagSighting:
    """A detected tag.

    Attributes:
        tag: its number.
        position: on the map, metres.
        in_vision: position in the robot's vision frame, for the arm.
        stamp_ns: time of detection in our time.
        reliable: whether the detector is sure of the tag's pose (neither ambiguous nor of high error).
    """

    tag: int
    position: Position
    in_vision: Position
    stamp_ns: int
    reliable: bool = True


def read_tags(
    objects: Iterable[world_object_pb2.WorldObject],
    map_tform_body: geometry_pb2.SE3Pose,
    clock: SessionClock,
    map_tform_odom: SE3Pose | None = None,
) -> tuple[TagSighting, ...]:
    """The fiducials among world objects, placed on the map where the body was when they were seen.

    The transforms of a world object are those of its acquisition, so that a tag is placed by way of odom, which does
    not jump: by the body's pose now, it would move along with the body.

    Args:
        map_tform_body: the body's current pose, for want of map_tform_odom.
        map_tform_odom: odom on the map by the last localisation.

    Their frames are the raw ones: the filtered ones average over time, and items are moved.
    """
    placed = SE3Pose.from_proto(map_tform_body)
    found: list[TagSighting] = []
    for thing in objects:
        if not thing.HasField("apriltag_properties"):
            continue
        mark = thing.apriltag_properties
        name = mark.frame_name_fiducial or mark.frame_name_fiducial_filtered
        body = tform(thing.transforms_snapshot, BODY_FRAME_NAME, name)
        vision = tform(thing.transforms_snapshot, VISION_FRAME_NAME, name)
        if body is None or vision is None:
            continue
        odom = None if map_tform_odom is None else tform(thing.transforms_snapshot, ODOM_FRAME_NAME, name)
        if map_tform_odom is None or odom is None:
            x, y, z = placed.transform_point(body.x, body.y, body.z)
        else:
            x, y, z = map_tform_odom.transform_point(odom.x, odom.y, odom.z)
        at = thing.acquisition_time
        found.append(
            TagSighting(
                tag=mark.tag_id,
                position=(x, y, z),
                in_vision=(vision.x, vision.y, vision.z),
                stamp_ns=clock.from_robot(at.seconds * NANO + at.nanos),
                reliable=mark.fiducial_pose_status not in _UNSURE,
            )
        )
    return tuple(found)


def within(container: Container, position: Position, *, margin_m: float) -> bool:
    """Whether a position is in or on a container."""
    dx, dy = position[0] - container.pose.x_m, position[1] - container.pose.y_m
    c, s = cos(container.pose.yaw_rad), sin(container.pose.yaw_rad)
    along, across = c * dx + s * dy, -s * dx + c * dy
    top = container.base_m + container.size_m[2] + REACH_UP_M
    return (
        abs(along) <= container.size_m[0] / 2 + margin_m
        and abs(across) <= container.size_m[1] / 2 + margin_m
        and position[2] <= top
    )
