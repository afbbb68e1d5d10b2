"""Visibility of tags: those in range with a clear line of sight; closed containers hide theirs.

Range: Spot's own fiducial detector sees a 0.146 m tag from about 3 m (Spot SDK, "Fiducials").
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, hypot, sin

from workbench.worlds.geometry import Pose
from workbench.worlds.house import Container, ContainerId
from workbench.worlds.sight.clear_line import clear_line
from workbench.worlds.sites.site import Site
from workbench.worlds.sites.survey_schema import ROBOT_TAG_M

RANGE_M = 3.0
CLOSED_RANGE_M = 0.6
"""Distance in metres from the standing pose of a closed container within which it is open."""
HAND_M = (0.75, 0.0, 0.35)
"""Position of a held item in the body frame."""
SPACING_M = 0.2


@dataclass(slots=True)
class TaggedThing:
    """A tagged item: in a container, in the hand, or placed elsewhere."""

    tag: int
    container: ContainerId | None
    position: tuple[float, float, float]
    held: bool = False
    size_m: float = ROBOT_TAG_M


def thing_in(tag: int, container: Container, place: int) -> TaggedThing:
    """An item in a container: on top of it, or inside if it is tall; the first in the centre, others beside it."""
    offset = (place + 1) // 2 * SPACING_M * (1 if place % 2 else -1)
    limit = max(0.0, container.size_m[0] / 2 - 0.05)
    along = max(-limit, min(limit, offset))
    yaw = container.pose.yaw_rad
    top = container.base_m + container.size_m[2]
    return TaggedThing(
        tag=tag,
        container=container.id,
        position=(container.pose.x_m + cos(yaw) * along, container.pose.y_m + sin(yaw) * along, min(top, 1.1)),
    )


def in_hand(pose: Pose) -> tuple[float, float, float]:
    c, s = cos(pose.yaw_rad), sin(pose.yaw_rad)
    return (pose.x_m + c * HAND_M[0] - s * HAND_M[1], pose.y_m + s * HAND_M[0] + c * HAND_M[1], HAND_M[2])


def sees(site: Site, pose: Pose, thing: TaggedThing) -> bool:
    """Whether the detector of a robot at a pose detects the tag of an item; a smaller one only from nearer by."""
    return shows(site, pose, thing, range_m=RANGE_M * min(1.0, thing.size_m / ROBOT_TAG_M))


def shows(site: Site, pose: Pose, thing: TaggedThing, *, range_m: float = RANGE_M) -> bool:
    """Whether a robot at a pose has the tag of an item in view, whichever way it looks."""
    if thing.held:
        return False
    spot = (thing.position[0], thing.position[1])
    if hypot(spot[0] - pose.x_m, spot[1] - pose.y_m) > range_m:
        return False
    if thing.container is not None and _is_closed(site, thing.container):
        stand = next((p for n, p in _standing(site) if n == thing.container), None)
        if stand is None or hypot(stand.x_m - pose.x_m, stand.y_m - pose.y_m) > CLOSED_RANGE_M:
            return False
    return clear_line(site.plan, pose.point, spot)


def _is_closed(site: Site, container: ContainerId) -> bool:
    return any(entry.closed for entry in site.file.containers if entry.id == container)


def _standing(site: Site) -> list[tuple[str, Pose]]:
    return [(str(name), pose) for name, pose in site.navigation.standing.items()]
