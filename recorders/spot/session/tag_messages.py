"""Detections of tags as messages of the log."""

from __future__ import annotations

from math import degrees

from bosdyn.client.math_helpers import SE3Pose

from recorders.spot.session.topics import TagDetected, TagPose
from recorders.spot.tags.detections import TagDetection, TagSighting
from recorders.spot.tags.item_places import MARGIN_M, container_at
from workbench.log_schema.events import NANO, Stamp
from workbench.worlds.sites.site import Site


def detected(
    site: Site, seen: TagDetection, placed: TagSighting | None, *, received_ns: int, counts: bool
) -> TagDetected:
    """A detection as a message.

    Args:
        placed: the same on the map; None if the robot was not localised.
        counts: whether looks go by it.
    """
    item, incidence = site.tags.get(seen.tag), seen.incidence_rad
    place = None if placed is None else container_at(site.plan, placed.position, margin_m=MARGIN_M)
    x_m, y_m, z_m = (None, None, None) if placed is None else map(float, placed.position)
    return TagDetected(
        stamp=Stamp.of(seen.stamp_ns),
        tag=seen.tag,
        item="" if item is None else item.id,
        detector=seen.detector.value,
        camera=seen.camera,
        status=seen.status.value,
        raw=_message(seen.frame, seen.raw),
        size_m=seen.size_m,
        age_s=round((received_ns - seen.stamp_ns) / NANO, 3),
        range_m=None if seen.range_m is None else float(seen.range_m),
        incidence_deg=None if incidence is None else degrees(incidence),
        error_px=seen.error_px,
        x_m=x_m,
        y_m=y_m,
        z_m=z_m,
        container=place or "",
        counts=counts,
    )


def _message(frame: str, pose: SE3Pose) -> TagPose:
    """A pose in floats of Python's own: those of SE3Pose may be NumPy's."""
    turn = pose.rot
    return TagPose(
        frame=frame,
        x=float(pose.x),
        y=float(pose.y),
        z=float(pose.z),
        qx=float(turn.x),
        qy=float(turn.y),
        qz=float(turn.z),
        qw=float(turn.w),
    )
