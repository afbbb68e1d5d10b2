"""Misses of the simulated tag detector, more frequent with distance and angle.

From one viewpoint it misses a tag or it does not, however long it looks: misses from one place are correlated (Velez
et al., JAIR 44, 2012). The draws depend only on the seed, the tag and the place: the same run misses the same.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from math import atan2, cos, hypot

from recorders.spot.simulated.body import wrapped
from recorders.spot.simulated.sight import RANGE_M, TaggedThing
from workbench.errors import BadValue
from workbench.worlds.geometry import Pose
from workbench.worlds.house import LocationId
from workbench.worlds.perception import viewpoint_square
from workbench.worlds.sites.site import Site
from workbench.worlds.sites.survey_schema import ROBOT_TAG_M


@dataclass(frozen=True, slots=True, kw_only=True)
class MissedTags:
    """A detector that misses tags.

    Attributes:
        rate: the chance to miss a tag from nearby and straight ahead, in [0, 1).
        seed: of the draws.

    Raises:
        BadValue: a rate outside [0, 1).
    """

    rate: float
    seed: int = 0

    def __post_init__(self) -> None:
        if not 0 <= self.rate < 1:
            raise BadValue("miss rate", self.rate, "at least 0 and below 1")

    def detects(self, range_m: float, angle_rad: float, size_m: float = ROBOT_TAG_M) -> float:
        """The chance that a viewpoint shows a tag.

        Args:
            range_m: how far away it is.
            angle_rad: between the line of sight and the one from which it is seen best.
            size_m: the side of its black square; a smaller one counts as farther away.
        """
        reach = range_m * max(1.0, ROBOT_TAG_M / size_m) / RANGE_M
        return (1.0 - self.rate) * max(0.0, 1.0 - reach**2) * max(0.0, cos(angle_rad))

    def misses(self, site: Site, pose: Pose, thing: TaggedThing) -> bool:
        """Whether the detector misses a tag, which is in view, of a robot at a pose."""
        square = viewpoint_square(pose.x_m, pose.y_m)
        digest = hashlib.sha256(repr((self.seed, thing.tag, square)).encode()).digest()
        drawn = int.from_bytes(digest[:8], "big") / 2**64
        range_m = hypot(thing.position[0] - pose.x_m, thing.position[1] - pose.y_m)
        return drawn >= self.detects(range_m, angle_of_view(site, pose, thing), thing.size_m)


def angle_of_view(site: Site, pose: Pose, thing: TaggedThing) -> float:
    """The angle between the line to the robot and the line to where one stands at the item's container, in [0, pi];
    0 for an item in none."""
    standing = None if thing.container is None else site.navigation.standing.get(LocationId(thing.container))
    if standing is None:
        return 0.0
    x, y = thing.position[0], thing.position[1]
    to_robot, to_stand = atan2(pose.y_m - y, pose.x_m - x), atan2(standing.y_m - y, standing.x_m - x)
    return abs(wrapped(to_robot - to_stand))
