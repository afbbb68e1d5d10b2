"""Whether what was recorded supports a look into a container, and looks that count as not looked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from workbench.message_enum import MessageEnum, Result
from workbench.worlds.geometry import Point
from workbench.worlds.house import ContainerId, LocationId


class LookFinding(MessageEnum):
    """Whether what was recorded supports a look, and if not, why the look is inconclusive."""

    SUPPORTED = ""
    NOTHING_DETECTS = "nothing in the bag detects tags"
    ROBOT_ELSEWHERE = "the robot was localised elsewhere"
    NOT_PLACED = "detections could not be placed: {reason}"
    FRAME_APART = "tags are detected in {frame}, which does not lead to {map_frame}"
    MAY_BE_SHUT = "it is closed furniture, nothing was seen in it, and nobody said that it was opened"
    MAY_BE_CARRIED = "what was seen may be something that the robot had picked up where no look had shown it"


class LookJudge(Protocol):
    """Judges whether a look is supported by what was recorded."""

    def judge(self, at: LocationId, start_ns: int, end_ns: int, robot: Point) -> Result[LookFinding]: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class InconclusiveLook:
    """A look that counts as not looked, because the recording does not support what it seems to have seen."""

    container: ContainerId
    start_ns: int
    end_ns: int
    reason: str
