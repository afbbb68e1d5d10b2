"""The support of a look by a bag: detections placed on the map while the robot stood there."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot
from typing import final

from recorders.spot.session.look_findings import LookFinding
from replayers.importers.frames import FrameBuffer
from workbench.log_schema.events import NANO
from workbench.message_enum import Result
from workbench.worlds.geometry import Point
from workbench.worlds.house import LocationId
from workbench.worlds.sites.site import Site

AT_CONTAINER_M = 1.5
"""A robot further than this from a container's standing pose was not at it, whatever its navigation reported."""
LATE_NS = NANO
"""A detection placed by a transform older than this is counted as placed late."""
NO_FRAME = "no frame_id"


@final
@dataclass(slots=True, kw_only=True)
class LookSupport:
    """Counts detections and judges looks.

    Args:
        site: the place with its standing poses.
        frames: the transforms so far.
        map_frame: the map frame as the bag calls it.
        detects: whether anything in the bag detects tags.
        detected_in: all frames in which tags are detected in the bag.

    Attributes:
        placed: detections placed on the map.
        late: those among them that were placed by a transform older than LATE_NS.
        not_placed: detections that could not be placed, by the reason.
    """

    site: Site
    frames: FrameBuffer
    map_frame: str
    detects: bool
    detected_in: frozenset[str]
    placed: int = 0
    late: int = 0
    not_placed: dict[str, int] = field(default_factory=dict)
    _placed_at: dict[int, list[int]] = field(default_factory=dict)
    _lost: list[tuple[int, int, str]] = field(default_factory=list)

    def place(self, number: int, frame: str, stamp_ns: int) -> None:
        """Counts a tag that was placed on the map."""
        self.placed += 1
        self.late += self.frames.age_ns(frame, stamp_ns) > LATE_NS
        self._placed_at.setdefault(number, []).append(stamp_ns)

    def miss(self, number: int, frame: str, stamp_ns: int) -> None:
        """Counts a tag that could not be placed."""
        reason = f"{frame} does not lead to {self.map_frame}" if frame else NO_FRAME
        self.not_placed[reason] = self.not_placed.get(reason, 0) + 1
        self._lost.append((stamp_ns, number, reason))

    def judge(self, at: LocationId, start_ns: int, end_ns: int, robot: Point) -> Result[LookFinding]:
        """Whether a look is supported by the bag.

        A detection that could not be placed does not matter where the same tag was placed during the same look, as
        when transforms begin a moment after detections.
        """
        if not self.detects:
            return LookFinding.NOTHING_DETECTS.result()
        standing = self.site.paths.standing_pose(at)
        if standing is not None and hypot(standing.x_m - robot[0], standing.y_m - robot[1]) > AT_CONTAINER_M:
            return LookFinding.ROBOT_ELSEWHERE.result()
        lost = {
            number: reason
            for stamp_ns, number, reason in self._lost
            if start_ns <= stamp_ns <= end_ns
            and not any(start_ns <= placed <= end_ns for placed in self._placed_at.get(number, ()))
        }
        if lost:
            return LookFinding.NOT_PLACED.result(reason=min(lost.values()))
        away = sorted(f for f in self.detected_in if self.frames.lookup(self.map_frame, f) is None)
        away = [frame for frame in away if frame != self.map_frame]
        if away:
            return LookFinding.FRAME_APART.result(frame=away[0], map_frame=self.map_frame)
        return LookFinding.SUPPORTED.result()
