"""The tags that OpenCV finds in the pictures of a robot's cameras."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from bosdyn.api import image_pb2
from bosdyn.client.image import build_image_request

from recorders.spot.client.clock import SessionClock
from recorders.spot.client.connection import Connection
from recorders.spot.tags.detections import Detector, TagDetection
from recorders.spot.tags.lens import lens_of
from recorders.spot.tags.opencv_detector import decode_grey, detect_tags, require_opencv
from workbench.log_schema.events import NANO
from workbench.worlds.sites.site import Site

QUALITY = 95
"""JPEG quality of the pictures that tags are looked for in."""


def tag_sizes(site: Site) -> dict[int, float]:
    """The sides in metres of the site's tags."""
    return {number: tag.size_m for number, tag in site.file.tags.items()}


def detector_cameras(site: Site) -> tuple[str, ...]:
    """The image sources in which our detector looks; none if the site chooses the robot's. A robot without an arm has
    none on its hand."""
    if site.file.detector.kind == "robot":
        return ()
    return tuple(n for n in site.file.detector.cameras if site.robot.arm or not n.startswith("hand"))


def require_detector(site: Site) -> None:
    """Check that the site's detector is installed.

    Raises:
        MissingExtra: it is not.
    """
    if site.file.detector.kind == "opencv":
        require_opencv()


def relevant_detections(site: Site, detections: Iterable[TagDetection]) -> tuple[TagDetection, ...]:
    """The detections that count: of items, those of the site's detector; of other tags, the robot's."""
    ours = items_detector(site) is Detector.OPENCV
    return tuple(
        seen for seen in detections if seen.detector is Detector.OPENCV or not ours or seen.tag not in site.tags
    )


def items_detector(site: Site) -> Detector:
    """The detector by which looks for items go."""
    return Detector.OPENCV if site.file.detector.kind == "opencv" else Detector.ROBOT


def picture_detections(connection: Connection, site: Site) -> tuple[TagDetection, ...]:
    """The tags of items in the pictures that the cameras of the site's detector show now; none if it chooses the
    robot's detector.

    Raises:
        bosdyn's errors. MissingExtra: OpenCV is not installed.
    """
    requests = [build_image_request(name, quality_percent=QUALITY) for name in detector_cameras(site)]
    if not requests:
        return ()
    answers: list[image_pb2.ImageResponse] = connection.client("image").get_image(
        requests, timeout=connection.timeout_s
    )
    return detections_in(answers, connection.clock, family=site.file.detector.family, sizes_m=tag_sizes(site))


def detections_in(
    answers: Iterable[image_pb2.ImageResponse], clock: SessionClock, *, family: str, sizes_m: Mapping[int, float]
) -> tuple[TagDetection, ...]:
    """The tags in pictures whose numbers have a size; others would be misplaced.

    The lens is the one that comes with each picture, and its frames are those of the time at which it was taken.
    """
    found: list[TagDetection] = []
    for answer in answers:
        shot = answer.shot
        picture = decode_grey(shot.image.data)
        if picture is None or not shot.frame_name_image_sensor:
            continue
        rows, columns = picture.shape
        at = shot.acquisition_time
        for seen in detect_tags(picture, lens_of(answer.source, columns, rows), family=family, sizes_m=sizes_m):
            if seen.tag not in sizes_m:
                continue
            found.append(
                TagDetection(
                    tag=seen.tag,
                    detector=Detector.OPENCV,
                    camera=shot.frame_name_image_sensor,
                    stamp_ns=clock.from_robot(at.seconds * NANO + at.nanos),
                    size_m=seen.size_m,
                    status=seen.status,
                    frame=shot.frame_name_image_sensor,
                    pose=seen.camera_tform_tag,
                    raw=seen.camera_tform_tag,
                    tree=shot.transforms_snapshot,
                    error_px=seen.error_px,
                )
            )
    return tuple(found)
