"""Derives events of a run from the messages of a bag, one by one, in the order of their time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import hypot
from typing import Any, final

from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.Pose_pb2 import Pose as PoseMessage
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.message import Message

from recorders.foxglove.scene import map_grid, timestamp, words
from recorders.mcap_io.channels import protobuf_channel
from recorders.run_recorder import RunRecorder
from recorders.spot.session.inferred_actions import ActionDeriver
from replayers.importers import decoding
from replayers.importers.bag_survey import LATCHED_ROLES, BagSurvey
from replayers.importers.bags import BagMessage
from replayers.importers.clocks import BagClock
from replayers.importers.frames import FrameBuffer, plain, quaternion_of
from replayers.importers.look_support import LookSupport
from replayers.importers.mapping import Mapping
from replayers.importers.pictures import calibration, compressed, occupancy, packed, turn_of
from replayers.importers.retrospective_plans import RetrospectivePlanner
from replayers.importers.tag_scene import tag_scene
from workbench.arrays import Floats
from workbench.execution.events import Event, RunEnded
from workbench.log_schema.events import NANO
from workbench.planning.tasks import Task
from workbench.search.costs import ROBOT_COSTS
from workbench.worlds.house import START, LocationId
from workbench.worlds.sites.site import UNSURVEYED, Site

GOAL_WITHIN_M = 1.5
"""A goal this close to a standing pose means that location."""


@dataclass(slots=True)
class _Goal:
    target: LocationId | None
    start_ns: int


@final
@dataclass(slots=True)
class BagDerivation:
    """Takes the messages of a bag one by one."""

    site: Site
    mapping: Mapping
    recorder: RunRecorder
    planner: RetrospectivePlanner
    task: Task
    given_moves: bool
    survey: BagSurvey
    clock: BagClock
    furniture_open: bool = False
    frames: FrameBuffer = field(default_factory=FrameBuffer)
    support: LookSupport = field(init=False)
    misframed: dict[tuple[str, str], int] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    unknown_tags: set[int] = field(default_factory=set)
    moves: int = 0
    derived: ActionDeriver = field(init=False)
    _goal: _Goal | None = None
    _handled_on: tuple[LocationId, int] | None = None
    _done: set[str] = field(default_factory=set)
    _calibrated: set[str] = field(default_factory=set)
    _began: bool = False
    _posed: bool = False
    _framed: set[int] = field(default_factory=set)
    _drawn: dict[int, int] = field(default_factory=dict)
    _takes: dict[str, Callable[[BagMessage, int], None]] = field(init=False)

    def __post_init__(self) -> None:
        def tell(event: Event) -> None:
            self.planner.take(self.derived, event)

        for child, (parent, transform) in sorted(self.survey.static.items()):
            self.frames.set(parent, child, transform)
        self.support = LookSupport(
            site=self.site,
            frames=self.frames,
            map_frame=plain(self.mapping.frames.map),
            detects=self.survey.detects,
            detected_in=frozenset(self.survey.detected_in),
        )
        self.derived = ActionDeriver(
            site=self.site,
            task=self.task,
            costs=ROBOT_COSTS,
            tell=tell,
            given_moves=self.given_moves,
            judge=self.support,
            closed_needs_word=True,
            furniture_open=self.furniture_open,
            perception=self.site.perception,
        )
        self._takes = {
            "markers": self._markers,
            "goals": self._goals,
            "results": self._results,
            "picks": lambda m, at: self._record_manipulation(m, at, "pick"),
            "places": lambda m, at: self._record_manipulation(m, at, "place"),
            "handling": lambda m, at: self._record_manipulation(m, at, "either"),
            "tf": self._tf,
            "tf_static": self._tf_static,
            "pose": self._pose,
            "odometry": self._odometry,
            "map": self._map,
            "calibrations": self._calibrations,
            "images": self._images,
        }

    def take(self, role: str, message: BagMessage) -> None:
        self.counts[role] = self.counts.get(role, 0) + 1
        own, _ = decoding.own_stamp(message.message)
        at = self.clock.time_of(message.stamp_ns, own, latched=role in LATCHED_ROLES)
        if not self._began:
            self._began = True
            self.planner.begin(self.derived, at)
        looks = len(self.derived.inconclusive)
        self._takes[role](message, at)
        self._tell_doubts(looks, at)

    def end(self) -> RunEnded:
        """Ends the run."""
        looks = len(self.derived.inconclusive)
        ended = self.derived.end()
        self._tell_doubts(looks, ended.stamp_ns)
        return ended

    def _tell_doubts(self, since: int, at: int) -> None:
        """Notes the inconclusive looks from the given number on as words of the log."""
        for look in self.derived.inconclusive[since:]:
            text = f"Look into {look.container} is inconclusive and counts as not looked: {look.reason}"
            self._put("/log", words(text, at, level=Log.WARNING, name="import"), at)

    def _markers(self, message: BagMessage, at: int) -> None:
        for marker in decoding.markers(message.message):
            if marker.pose is None:
                if marker.number not in self._framed:
                    self.support.miss(marker.number, f"tag {marker.number} without a pose", at)
                continue
            placed = self._on_map(marker.frame, marker.pose) if marker.frame else None
            if placed is None:
                self.support.miss(marker.number, plain(marker.frame), at)
            else:
                self._tag(marker.number, placed, at, marker.frame)

    def _tag(self, number: int, placed: Floats, at: int, frame: str) -> None:
        self.support.place(number, frame, at)
        if number not in self.site.tags:
            self.unknown_tags.add(number)
        if self.site.name == UNSURVEYED and at - self._drawn.get(number, 0) >= NANO:
            self._drawn[number] = at
            self._put("/robot/fiducials", tag_scene(number, placed, at), at)
        self.derived.tag(at, number, (float(placed[0, 3]), float(placed[1, 3]), float(placed[2, 3])))

    def _goals(self, message: BagMessage, at: int) -> None:
        wanted = decoding.goal_pose(message.message)
        if wanted is None:
            return
        frame, pose, _ = wanted
        placed = self._on_map(frame or self.mapping.frames.map, pose)
        target = None if placed is None else self._location(float(placed[0, 3]), float(placed[1, 3]))
        if self._goal is None or self._goal.target != target:
            self._goal = _Goal(target, at)

    def _results(self, message: BagMessage, at: int) -> None:
        for result in decoding.results(message.message):
            if self._already_recorded(result):
                continue
            goal, self._goal = self._goal, None
            if goal is None or goal.target is None:
                continue
            self.moves += 1
            reason = "" if result.success else result.words
            self.derived.moved(goal.start_ns, at, goal.target, success=result.success, reason=reason)

    def _record_manipulation(self, message: BagMessage, at: int, kind: str) -> None:
        """Records the arm's results: a pick or a place. One that may be either counts once for each visit, because an
        arm that picks makes several motions, and not before the first arrival, where arms are stowed."""
        holds = decoding.held(message.message)
        if holds is not None:
            self.derived.holding(at, holds)
            return
        for result in decoding.results(message.message):
            if not result.success or self._already_recorded(result):
                continue
            visit = (self.derived.knowledge.robot_at, self.derived.visits)
            at_start = visit[0] == START and not self.derived.hand_full
            if kind == "either" and (visit == self._handled_on or at_start):
                continue
            self._handled_on = visit
            holding = self.derived.hand_full
            if kind == "pick" or (kind == "either" and not holding):
                self.derived.holding(at, True)
            elif holding:
                self.derived.holding(at, False)

    def _already_recorded(self, result: decoding.ActionResult) -> bool:
        """Whether the end of an action was recorded already: status messages repeat it. Without a key it is always
        new."""
        if result.key in self._done:
            return True
        if result.key:
            self._done.add(result.key)
        return False

    def _tf(self, message: BagMessage, at: int) -> None:
        for link in message.message.transforms:
            self.frames.add(link.header.frame_id, link.child_frame_id, link.transform, stamp_ns=at)
        for link in message.message.transforms:
            number = self.mapping.tag_of(plain(link.child_frame_id))
            if number is None:
                continue
            self._framed.add(number)
            placed = self.frames.lookup(self.mapping.frames.map, link.child_frame_id)
            if placed is None:
                self.support.miss(number, plain(link.header.frame_id), at)
            else:
                self._tag(number, placed, at, link.child_frame_id)
        self._put("/tf", self._transforms(message, at), at)
        self._by_tf(at)

    def _tf_static(self, message: BagMessage, at: int) -> None:
        """Passes static transforms on; they hold from the beginning, by the first pass."""
        for link in message.message.transforms:
            self.frames.add(link.header.frame_id, link.child_frame_id, link.transform)
        self._put("/tf", self._transforms(message, at), at)

    def _by_tf(self, at: int) -> None:
        """Places the robot by tf, where no pose topic does."""
        if self._posed:
            return
        placed = self.frames.lookup(self.mapping.frames.map, self.mapping.frames.body)
        if placed is not None:
            self._at(placed, at)

    def _pose(self, message: BagMessage, at: int) -> None:
        posed = decoding.body_pose(message.message)
        if posed is None:
            return
        placed = self._on_map(posed[0], posed[1])
        if placed is None:
            where = (message.topic, plain(posed[0]))
            self.misframed[where] = self.misframed.get(where, 0) + 1
            return
        self._posed = True
        self._at(placed, at)

    def _at(self, placed: Floats, at: int) -> None:
        self._put("/robot/pose", _in_frame(placed, "map", at), at)
        self.derived.pose(at, (float(placed[0, 3]), float(placed[1, 3])))

    def _odometry(self, message: BagMessage, at: int) -> None:
        posed = decoding.body_pose(message.message)
        if posed is not None:
            self._put("/robot/odometry", _in_frame(posed[1], "odom", at), at)

    def _map(self, message: BagMessage, at: int) -> None:
        grid = occupancy(message.message)
        if grid is not None:
            self._put("/map", map_grid(grid, at, yaw_rad=turn_of(message.message)), at, latched=True)

    def _images(self, message: BagMessage, at: int) -> None:
        raw = hasattr(message.message, "encoding")
        picture = packed(message.message, at) if raw else compressed(message.message, at)
        if picture is not None:
            self._put("/camera" + _camera(message.topic), picture, at)

    def _calibrations(self, message: BagMessage, at: int) -> None:
        """Records each camera's calibration once: it does not change."""
        topic = "/camera" + _camera(message.topic) + "/calibration"
        if topic not in self._calibrated:
            self._calibrated.add(topic)
            self._put(topic, calibration(message.message, at), at, latched=True)

    def _on_map(self, frame: str, pose: Floats) -> Floats | None:
        name = self.mapping.frames.map
        if plain(frame) in (plain(name), ""):
            return pose
        link = self.frames.lookup(name, frame)
        return None if link is None else link @ pose

    def _location(self, x: float, y: float) -> LocationId | None:
        site = self.site
        away = [
            (hypot(pose.x_m - x, pose.y_m - y), name)
            for name in site.travel.locations
            if (pose := site.paths.standing_pose(name)) is not None
        ]
        best = min(away, default=None)
        return best[1] if best is not None and best[0] <= GOAL_WITHIN_M else None

    def _transforms(self, message: BagMessage, at: int) -> FrameTransforms:
        """tf with the mapping's frames under our names: map, odom, base_link."""
        ours = self.mapping.frames
        names = {plain(ours.map): "map", plain(ours.odom): "odom", plain(ours.body): "base_link"}
        return FrameTransforms(
            transforms=[
                FrameTransform(
                    timestamp=timestamp(self._time_of(link, message)),
                    parent_frame_id=names.get(plain(link.header.frame_id), plain(link.header.frame_id)),
                    child_frame_id=names.get(plain(link.child_frame_id), plain(link.child_frame_id)),
                    translation=_vector(link.transform.translation),
                    rotation=_quaternion(link.transform.rotation),
                )
                for link in message.message.transforms
            ]
        )

    def _time_of(self, link: Any, message: BagMessage) -> int:
        own, _ = decoding.own_stamp(link)
        latched = self.mapping.role_of(message.topic) in LATCHED_ROLES
        return self.clock.time_of(message.stamp_ns, own, latched=latched)

    def _put(self, topic: str, message: Message, at: int, *, latched: bool = False) -> None:
        channel = protobuf_channel(topic, type(message), latched=latched)
        self.recorder.sink.write(channel, message.SerializeToString(deterministic=True), log_time=at)


def _camera(topic: str) -> str:
    """ "/spot/camera/frontleft/image" -> "/spot/frontleft"."""
    dropped = ("camera", "image", "image_raw", "compressed", "image_color", "camera_info")
    return "".join(f"/{part}" for part in topic.split("/") if part and part not in dropped) or "/image"


def _in_frame(pose: Floats, frame: str, at: int) -> PoseInFrame:
    x, y, z, w = quaternion_of(pose)
    position = Vector3(x=float(pose[0, 3]), y=float(pose[1, 3]), z=float(pose[2, 3]))
    return PoseInFrame(
        timestamp=timestamp(at),
        frame_id=frame,
        pose=PoseMessage(position=position, orientation=Quaternion(x=x, y=y, z=z, w=w)),
    )


def _vector(value: Any) -> Vector3:
    return Vector3(x=float(value.x), y=float(value.y), z=float(value.z))


def _quaternion(value: Any) -> Quaternion:
    return Quaternion(x=float(value.x), y=float(value.y), z=float(value.z), w=float(value.w))
