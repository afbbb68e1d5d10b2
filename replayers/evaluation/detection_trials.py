"""Trials of detection in a log: an item that is known to be in a container, a viewpoint, and whether it was detected.

A look counts for an item only once something other than that look shows that the item is there: an earlier look, a
person's correction, what was planted, or a simulation's truth. The look that first shows an item says nothing of how
often such looks miss, since without it nobody would know of the item.

An item that a look shows because the operator said that it is there was not thereby detected: whether it was is read
from the detections in the log.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import atan2, hypot, inf, pi

import msgspec
import numpy as np

from replayers.log_tools.notes import note_from
from replayers.mcap_io.messages import Message
from replayers.mcap_io.poses import poses_in
from replayers.mcap_io.reader import messages
from replayers.runs.run import Run
from workbench.arrays import Floats
from workbench.log_schema.codec import UndecodableMessage
from workbench.log_schema.corrections import NOTE_SCHEMA, NOTE_TOPIC, Correction, item_said_there, made_up_id
from workbench.log_schema.events import Observation, Stamp
from workbench.worlds.geometry import Point
from workbench.worlds.house import ContainerId, ItemType, LocationId
from workbench.worlds.perception import viewpoint_square
from workbench.worlds.sight.clear_line import clear_line

DETECTIONS, POLLS, FIDUCIALS = "/robot/detections", "/robot/tag_polls", "/robot/fiducials"
"""Topics of a robot's log: every new detection of a tag; one message each time that a detector was asked; one each
time that it saw a tag (all that logs of earlier versions have)."""
ASKED = frozenset({DETECTIONS, POLLS, FIDUCIALS, "/spot/world_objects"})
"""Topics whose messages show that the robot was asked for tags at that time."""
IN_VIEW_M = 4.0
"""Distance in metres beyond which a tag in passing does not count as in view."""
LOOK, PASSING = "look", "in passing"


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantedItem:
    """An item that a person put into a container before the runs."""

    item: str
    container: str


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionTrial:
    """An item that was there, and whether it was detected.

    Attributes:
        made: in a look into its container, or in passing.
        range_m: from the robot to the container; None where no pose is known.
        angle_rad: at the container, between the robot and where one stands there, in [0, pi]; None likewise.
    """

    log: str
    made: str
    detector: str
    item_type: str
    container_type: str
    range_m: float | None
    angle_rad: float | None
    detected: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialsOfLog:
    """The trials that one log shows."""

    log: str
    run_id: str
    trials: tuple[DetectionTrial, ...]


def each_once(found: Iterable[TrialsOfLog]) -> tuple[list[TrialsOfLog], dict[str, str]]:
    """The logs of which no run counts twice; and the copies that are left out, each with the log that counts for it.

    A copy (compressed, filtered, made for others) shows no trial that the other log of its run does not show; a part
    of a split log does.
    """
    kept: list[TrialsOfLog] = []
    copies: dict[str, str] = {}
    for one in sorted(found, key=lambda each: -len(each.trials)):
        shown = _counted(one)
        whole = next((k for k in kept if k.run_id == one.run_id and shown <= _counted(k)), None)
        if whole is None:
            kept.append(one)
        elif one.trials:
            copies[one.log] = whole.log
    return kept, copies


def _counted(of_log: TrialsOfLog) -> Counter[DetectionTrial]:
    """How often a log shows each trial, whatever the log is called."""
    return Counter(replace(trial, log="") for trial in of_log.trials)


class _Detection(msgspec.Struct):
    """What is read of lios.spot.TagDetected."""

    stamp: Stamp
    item: str = ""
    detector: str = "robot"
    counts: bool = True


class _Poll(msgspec.Struct):
    """What is read of lios.spot.TagPoll."""

    stamp: Stamp
    localized: bool
    counts: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class _Placed:
    """An item in a container, since when that is known, and until when it stood there, in nanoseconds."""

    item: str
    item_type: str
    container: ContainerId
    known_ns: float
    until_ns: float


def detection_trials(
    run: Run, planted: Sequence[PlantedItem] = (), *, checked: bool = False
) -> Iterator[DetectionTrial]:
    """The trials in one log, looks first.

    Args:
        run: which; read with its truth where that is to count.
        planted: what is known to have stood where in this run.
        checked: people checked the containers: what no look showed and nobody corrected was not there. Then the
            looks that first showed an item, and those that a correction is about, count as well.

    Raises:
        UndecodableMessage: a detection, a poll or a pose in the log is none.
    """
    placed, poses = tuple(_placed(run, planted, checked=checked)), _poses(run)
    found = _detections(run)
    detector = next((d.detector for d in found if d.counts), run.info.source)
    by_word = _shown_by_word(run, found)
    for seen in sorted(run.observations, key=lambda o: o.stamp.ns):
        if not seen.known_at_start:
            yield from _of_look(run, seen, placed, poses, detector, by_word)
    if len(poses):
        yield from _in_passing(run, placed, poses, found, detector)


def _placed(run: Run, planted: Sequence[PlantedItem], *, checked: bool) -> Iterator[_Placed]:
    """Every item whose container at the start of the run is known, and since when."""
    taken = {a.items[0]: a.start.ns for a in reversed(run.actions) if a.action == "pick" and a.success and a.items}
    known: dict[tuple[str, str], tuple[str, float]] = {}
    for container, items in (run.truth.contents if run.truth is not None else {}).items():
        known |= {(item.id, container): (item.type, -inf) for item in items}
    shown = {i.id: i.type for o in run.observations for i in o.items}
    for one in planted:
        known.setdefault((one.item, one.container), (shown.get(one.item, one.item.partition("|")[0]), -inf))
    for seen in sorted(run.observations, key=lambda o: o.stamp.ns):
        for item in seen.items:
            carried = taken.get(item.id, inf) < seen.stamp.ns
            if not carried and not any(key[0] == item.id for key in known):
                since = -inf if checked or seen.known_at_start else seen.stamp.ns
                known[item.id, seen.container] = (item.type, since)
    for correction in run.corrections:
        since = -inf if checked else correction.stamp_ns
        key = _same_item(known, correction)
        known[key] = (correction.item.type, min(since, known[key][1] if key in known else inf))
    for (item, container), (item_type, since) in sorted(known.items()):
        yield _Placed(
            item=item,
            item_type=item_type,
            container=ContainerId(container),
            known_ns=since,
            until_ns=taken.get(item, inf),
        )


def _same_item(known: Mapping[tuple[str, str], tuple[str, float]], correction: Correction) -> tuple[str, str]:
    """The item that a correction is about: one of its type that is known to be there, if it names only the type."""
    item, container = correction.item, correction.container
    if item.id == made_up_id(item.type, container):
        there = (key for key, (item_type, _) in known.items() if key[1] == container and item_type == item.type)
        return next(there, (item.id, container))
    return item.id, container


def _shown_by_word(run: Run, found: Sequence[_Detection]) -> Mapping[tuple[int, str], bool | None]:
    """By the stamp of a look and an item that the operator said was there: whether the detector saw it as well.

    None where that is unknown: the log does not say when the look began, or the robot was not asked for tags in it.
    """
    notes = [note_from(m) for m in messages(run.path, topics=NOTE_TOPIC.__eq__) if _is_event(m)]
    said = [(note.start_ns, item) for note in notes if (item := item_said_there(note.text)) is not None]
    if not said:
        return {}
    asked = [m.log_time for m in messages(run.path, topics=ASKED.__contains__)]
    began = {(a.target, a.stamp.ns): a.start.ns for a in run.actions if a.action == "search"}
    answer: dict[tuple[int, str], bool | None] = {}
    before_ns = 0
    for seen in sorted(run.observations, key=lambda o: o.stamp.ns):
        end_ns = seen.stamp.ns
        start_ns = began.get((seen.container, end_ns), end_ns)
        looked = any(start_ns < stamp < end_ns for stamp in asked)
        for item in {item for stamp, item in said if before_ns < stamp <= end_ns}:
            detected = any(d.item == item and d.counts and start_ns <= d.stamp.ns <= end_ns for d in found)
            answer[end_ns, item] = detected if looked else None
        before_ns = end_ns
    return answer


def _is_event(message: Message) -> bool:
    return message.schema is not None and message.schema.name == NOTE_SCHEMA


def _of_look(
    run: Run,
    seen: Observation,
    placed: Iterable[_Placed],
    poses: Floats,
    detector: str,
    by_word: Mapping[tuple[int, str], bool | None],
) -> Iterator[DetectionTrial]:
    named = None if seen.look is None else set(seen.look.item_types)
    detector = detector if seen.look is None else seen.look.detector or detector
    shown, types = {item.id for item in seen.items}, {item.type for item in seen.items}
    at = _viewpoint(run, seen, poses)
    for one in placed:
        if one.container != seen.container or not one.known_ns < seen.stamp.ns <= one.until_ns:
            continue
        only_type = one.item == made_up_id(ItemType(one.item_type), one.container)
        found: bool | None = one.item in shown or (only_type and one.item_type in types)
        if one.item in shown:
            found = by_word.get((seen.stamp.ns, one.item), found)
        if found is not None and (named is None or one.item_type in named):
            made = LOOK if seen.passing is None else PASSING
            yield _trial(run, one, at, made, detector, detected=found)


def _in_passing(
    run: Run, placed: Sequence[_Placed], poses: Floats, found: Sequence[_Detection], detector: str
) -> Iterator[DetectionTrial]:
    """One trial for each item and viewpoint of a robot that was asked for tags there and had the item in view."""
    asked = np.array(_asked(run), dtype=np.int64)
    opened = {o.container for o in run.observations if o.opened_by} | {
        a.target for a in run.actions if a.action == "search" and not a.success
    }
    for one in placed:
        if one.container in opened:
            continue
        sights = [d.stamp.ns for d in found if d.item == one.item and d.stamp.ns < one.until_ns]
        seen_from = {viewpoint_square(*_pose_at(poses, stamp)) for stamp in sights}
        before = asked[(asked < one.until_ns) & (asked > one.known_ns)]
        viewpoints = {viewpoint_square(*_pose_at(poses, stamp)): _pose_at(poses, stamp) for stamp in before.tolist()}
        for cell, at in sorted(viewpoints.items()):
            if _in_view(run, one.container, at):
                yield _trial(run, one, at, PASSING, detector, detected=cell in seen_from)


def _trial(run: Run, one: _Placed, at: Point | None, made: str, detector: str, *, detected: bool) -> DetectionTrial:
    container = run.place.plan.container(one.container)
    range_m, angle_rad = None, None
    if at is not None:
        x, y = container.pose.x_m, container.pose.y_m
        range_m = hypot(at[0] - x, at[1] - y)
        standing = run.place.standing.get(LocationId(one.container))
        if standing is not None:
            apart = atan2(at[1] - y, at[0] - x) - atan2(standing.y_m - y, standing.x_m - x)
            angle_rad = abs((apart + pi) % (2 * pi) - pi)
    return DetectionTrial(
        log=str(run.path),
        made=made,
        detector=detector,
        item_type=one.item_type,
        container_type=container.type,
        range_m=range_m,
        angle_rad=angle_rad,
        detected=detected,
    )


def _detections(run: Run) -> tuple[_Detection, ...]:
    try:
        return tuple(
            msgspec.json.decode(m.data, type=_Detection) for m in messages(run.path, topics=DETECTIONS.__eq__)
        )
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise UndecodableMessage(DETECTIONS, str(error)) from error


def _asked(run: Run) -> list[int]:
    """When the detector by which looks go was asked for tags and the robot's pose was known, in nanoseconds.

    In logs without polls, when it saw any tag: moments at which it saw none are missing, and rates come out too high.
    """
    try:
        polls = [msgspec.json.decode(m.data, type=_Poll) for m in messages(run.path, topics=POLLS.__eq__)]
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise UndecodableMessage(POLLS, str(error)) from error
    if polls:
        return [poll.stamp.ns for poll in polls if poll.counts and poll.localized]
    return [m.log_time for m in messages(run.path, topics=FIDUCIALS.__eq__)]


def _viewpoint(run: Run, seen: Observation, poses: Floats) -> Point | None:
    """Where the robot stood: by its poses, as the look says, or where one stands at the container."""
    if len(poses):
        return _pose_at(poses, seen.stamp.ns)
    if seen.look is not None and seen.look.viewpoint:
        return (seen.look.viewpoint[0], seen.look.viewpoint[1])
    standing = run.place.standing.get(LocationId(seen.container))
    return None if standing is None else standing.point


def _in_view(run: Run, container: ContainerId, at: Point) -> bool:
    pose = run.place.plan.container(container).pose
    near = hypot(pose.x_m - at[0], pose.y_m - at[1]) <= IN_VIEW_M
    return near and clear_line(run.place.plan, at, pose.point)


def _poses(run: Run) -> Floats:
    """The robot's poses on the map: stamp in nanoseconds, x, y in metres; shape (poses, 3), sorted."""
    if run.info.source == "simulation":
        return np.empty((0, 3))
    on_map = ((stamp_ns, pose.pose.position) for stamp_ns, pose in poses_in(run.raw_poses) if pose.frame_id == "map")
    rows = [(float(stamp_ns), position.x, position.y) for stamp_ns, position in on_map]
    return np.array(sorted(rows), dtype=np.float64).reshape(-1, 3)


def _pose_at(poses: Floats, stamp_ns: float) -> Point:
    i = min(max(int(np.searchsorted(poses[:, 0], stamp_ns)), 0), len(poses) - 1)
    return (float(poses[i, 1]), float(poses[i, 2]))
