"""Fiducial tags as a detector reports them, and their positions on the map."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from math import acos, sqrt

from bosdyn.api import geometry_pb2, world_object_pb2
from bosdyn.client.frame_helpers import BODY_FRAME_NAME, ODOM_FRAME_NAME, VISION_FRAME_NAME
from bosdyn.client.math_helpers import SE3Pose

from recorders.spot.client.clock import SessionClock
from recorders.spot.client.frame_trees import tform
from recorders.spot.tags.item_places import Position
from workbench.log_schema.events import NANO
from workbench.tolerances import TINY
from workbench.worlds.sites.survey_schema import ROBOT_TAG_M


class TagStatus(StrEnum):
    """What a detector says of the pose of a tag (world_object.proto, AprilTagPoseStatus)."""

    UNKNOWN = "unknown"
    OK = "ok"
    AMBIGUOUS = "ambiguous"
    HIGH_ERROR = "high error"


class Detector(StrEnum):
    """Who found a tag: the robot's own detector, or ours in its pictures."""

    ROBOT = "robot"
    OPENCV = "opencv"


@dataclass(frozen=True, slots=True, kw_only=True)
class TagDetection:
    """A tag as detected in one picture: x to the right and y up along the tag, z out of the page.

    Attributes:
        camera: the frame of the camera that saw it; "" if the robot did not say.
        stamp_ns: time of acquisition in our time.
        size_m: the side of its black square by the site.
        frame, pose: frame_tform_tag at the time of acquisition, of a tag of size_m, from its camera or the body.
        raw: the same as the detector reported it, of a tag of the size that it expects.
        tree: the frames at the time of acquisition.
        error_px: how far its corners are from where the pose puts them, root mean square; None if unknown.
    """

    tag: int
    detector: Detector
    camera: str
    stamp_ns: int
    size_m: float
    status: TagStatus
    frame: str
    pose: SE3Pose
    raw: SE3Pose
    tree: geometry_pb2.FrameTreeSnapshot
    error_px: float | None = None

    @property
    def is_reliable(self) -> bool:
        """Whether the detector is sure of the tag's pose (neither ambiguous nor of high error)."""
        return self.status not in (TagStatus.AMBIGUOUS, TagStatus.HIGH_ERROR)

    @property
    def range_m(self) -> float | None:
        """The distance from the camera; None if the camera is unknown."""
        return None if self.frame != self.camera else _length(self.pose)

    @property
    def incidence_rad(self) -> float | None:
        """The angle between the line of sight and the tag's normal: 0 for a tag that faces the camera."""
        if self.frame != self.camera:
            return None
        x, y, z = self.pose.rot.transform_point(0.0, 0.0, 1.0)
        towards = -(x * self.pose.x + y * self.pose.y + z * self.pose.z)
        return acos(max(-1.0, min(1.0, towards / max(_length(self.pose), TINY))))

    def seen_from(self, frame: str) -> SE3Pose | None:
        """The tag's pose in another frame at the time of acquisition; None if that is not in the tree."""
        link = tform(self.tree, frame, self.frame)
        return None if link is None else link.mult(self.pose)


@dataclass(frozen=True, slots=True, kw_only=True)
class TagSighting:
    """A detected tag, placed.

    Attributes:
        position: on the map, metres.
        in_vision: position in the robot's vision frame, for the arm.
    """

    detection: TagDetection
    position: Position
    in_vision: Position

    @property
    def tag(self) -> int:
        return self.detection.tag

    @property
    def stamp_ns(self) -> int:
        """Time of acquisition in our time."""
        return self.detection.stamp_ns

    @property
    def reliable(self) -> bool:
        return self.detection.is_reliable


def robot_detections(
    objects: Iterable[world_object_pb2.WorldObject], clock: SessionClock, sizes_m: Mapping[int, float]
) -> tuple[TagDetection, ...]:
    """The fiducials among world objects.

    Their frames are the raw ones: the filtered ones average over time, and items are moved. The robot takes each tag
    for one of the size that it names; one of another size is as much nearer or farther along the line of sight.

    Args:
        sizes_m: sides of tags; others have the size that the robot expects.
    """
    found: list[TagDetection] = []
    for thing in objects:
        if not thing.HasField("apriltag_properties"):
            continue
        mark, tree = thing.apriltag_properties, thing.transforms_snapshot
        name = mark.frame_name_fiducial or mark.frame_name_fiducial_filtered
        camera = tform(tree, mark.frame_name_camera, name) if mark.frame_name_camera else None
        raw = tform(tree, BODY_FRAME_NAME, name) if camera is None else camera
        if raw is None:
            continue
        expected_m = mark.dimensions.x or ROBOT_TAG_M
        size_m = sizes_m.get(mark.tag_id, expected_m)
        at = thing.acquisition_time
        found.append(
            TagDetection(
                tag=mark.tag_id,
                detector=Detector.ROBOT,
                camera=mark.frame_name_camera,
                stamp_ns=clock.from_robot(at.seconds * NANO + at.nanos),
                size_m=size_m,
                status=_STATUS.get(mark.fiducial_pose_status, TagStatus.UNKNOWN),
                frame=BODY_FRAME_NAME if camera is None else mark.frame_name_camera,
                pose=raw if camera is None else _at_scale(raw, size_m / expected_m),
                raw=raw,
                tree=tree,
            )
        )
    return tuple(found)


def place_on_map(detections: Iterable[TagDetection], map_tform_odom: SE3Pose | None) -> tuple[TagSighting, ...]:
    """Where tags were when they were seen: by way of odom, which does not jump, at the time of their acquisition.

    By the body's pose now, a tag seen before would move along with the body. What is not known in odom is not placed.

    Args:
        map_tform_odom: odom on the map by the last localisation; None places nothing.
    """
    if map_tform_odom is None:
        return ()
    placed: list[TagSighting] = []
    for seen in detections:
        odom, vision = seen.seen_from(ODOM_FRAME_NAME), seen.seen_from(VISION_FRAME_NAME)
        if odom is None or vision is None:
            continue
        x, y, z = map_tform_odom.transform_point(odom.x, odom.y, odom.z)
        placed.append(TagSighting(detection=seen, position=(x, y, z), in_vision=(vision.x, vision.y, vision.z)))
    return tuple(placed)


def _at_scale(pose: SE3Pose, factor: float) -> SE3Pose:
    """A pose at another distance along the line of sight."""
    return SE3Pose(x=pose.x * factor, y=pose.y * factor, z=pose.z * factor, rot=pose.rot)


def _length(pose: SE3Pose) -> float:
    return sqrt(pose.x**2 + pose.y**2 + pose.z**2)


_STATUS = {
    world_object_pb2.AprilTagProperties.STATUS_OK: TagStatus.OK,
    world_object_pb2.AprilTagProperties.STATUS_AMBIGUOUS: TagStatus.AMBIGUOUS,
    world_object_pb2.AprilTagProperties.STATUS_HIGH_ERROR: TagStatus.HIGH_ERROR,
}
