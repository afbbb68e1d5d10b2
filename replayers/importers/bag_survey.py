"""The first pass over a bag: static transforms, the frames by their own names, the clock, and what detects tags."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import final

from replayers.importers import decoding
from replayers.importers.bags import Bag, BagMessage
from replayers.importers.clocks import BagClock, ClockName, ClockSurvey
from replayers.importers.frames import FrameBuffer, plain
from replayers.importers.mapping import BagFrames, Mapping
from workbench.arrays import Floats
from workbench.errors import Malformed

LATCHED_ROLES = frozenset({"tf_static", "map", "calibrations"})
"""Roles whose messages hold for all time, whenever they were stamped or recorded."""
PASSED = frozenset({"images", "calibrations", "map"})
"""Roles that the first pass leaves out: they are large, and say nothing about places or times."""
EXAMPLES = 8
"""How many frames and topics an error lists."""


class RobotNotLocated(Malformed):
    """A bag that does not say where the robot was on the map."""

    def __init__(self, path: Path, mapping: Mapping, topics: tuple[str, ...], survey: BagSurvey) -> None:
        frames, seen = mapping.frames, sorted(survey.frames.names)
        listed = _some(topics)
        linked = f" Frames: {_some(seen)}." if seen else ""
        poses = ", ".join(f"{topic} in frame {frame}" for topic, frame in sorted(survey.pose_frames.items()))
        posed = f" Poses: {poses}, which does not lead to {frames.map}." if poses else ""
        super().__init__(
            f"{path}: nothing places the robot on the map: no tf from {frames.map} to {frames.body}, no mapped pose "
            f"topic in that frame (mapping {mapping.name}).{posed}{linked} Topics: {listed}. "
            "Map a pose topic, or correct the mapping's frames."
        )


@final
@dataclass(slots=True)
class BagSurvey:
    """What the first pass collects.

    Attributes:
        frames: all transforms heard, the newest of each child.
        static: (parent, child, transform) of the static ones, the first of each child.
        detected_in: frames in which tags were detected.
        detects: whether anything in the bag detects tags: a topic of detections, or a tag's frame in tf.
        pose_frames: per pose topic, the frame of its first pose.
        named: the mapping's frames as the bag calls them, when they became known; None if they never did.
    """

    mapping: Mapping
    roles: dict[str, str]
    frames: FrameBuffer = field(default_factory=FrameBuffer)
    static: dict[str, tuple[str, Floats]] = field(default_factory=dict)
    detected_in: set[str] = field(default_factory=set)
    detects: bool = False
    pose_frames: dict[str, str] = field(default_factory=dict)
    named: BagFrames | None = None
    times: ClockSurvey = field(default_factory=ClockSurvey)
    zero_stamps: int = 0

    def take(self, message: BagMessage) -> None:
        """Takes a message of a mapped topic."""
        role = self.roles[message.topic]
        if role not in LATCHED_ROLES:
            own, stamped = decoding.own_stamp(message.message)
            self.zero_stamps += stamped and own == 0
            self.times.add(message.topic, message.stamp_ns, own)
        if role in ("tf", "tf_static"):
            self._links(message, static=role == "tf_static")
        elif role == "markers":
            self.detects = True
            self.detected_in.update(plain(m.frame) for m in decoding.markers(message.message) if m.frame)
        elif role == "pose":
            posed = decoding.body_pose(message.message)
            if posed is not None:
                self.pose_frames.setdefault(message.topic, plain(posed[0]))
        if self.named is None and role in ("tf", "tf_static", "pose"):
            self._resolve()

    def _links(self, message: BagMessage, *, static: bool) -> None:
        for link in message.message.transforms:
            self.frames.add(link.header.frame_id, link.child_frame_id, link.transform)
            child = plain(link.child_frame_id)
            if static and child not in self.static:
                self.static[child] = self.frames.parent_of(child)
            self.detects = self.detects or self.mapping.tag_of(child) is not None

    def _resolve(self) -> None:
        names, frames = self.mapping.frames, self.frames
        found = BagFrames(map=frames.named(names.map), odom=frames.named(names.odom), body=frames.named(names.body))
        known = frames.lookup(found.map, found.body) is not None or any(
            frame == found.map or frames.lookup(found.map, frame) is not None for frame in self.pose_frames.values()
        )
        self.named = found if known else None


def survey_bag(
    bag: Bag, mapping: Mapping, roles: dict[str, str], clock: ClockName | None
) -> tuple[BagSurvey, BagFrames, BagClock]:
    """The first pass, so that no log is begun for a bag that does not say where and when the robot was.

    Args:
        roles: role by topic.
        clock: the user's choice of the clock; None for the rule.

    Raises:
        RobotNotLocated, BrokenClocks. UnknownMessageType, NotABag: it cannot be read.
    """
    survey = BagSurvey(mapping, roles)
    for message in bag.messages(tuple(topic for topic, role in sorted(roles.items()) if role not in PASSED)):
        survey.take(message)
    if survey.named is None:
        raise RobotNotLocated(bag.path, mapping, bag.topics, survey)
    chosen = survey.times.choose(bag.path, clock, bag.start_ns, survey.zero_stamps)
    return survey, survey.named, chosen


def _some(names: list[str] | tuple[str, ...]) -> str:
    return ", ".join(names[:EXAMPLES]) + (", ..." if len(names) > EXAMPLES else "")
