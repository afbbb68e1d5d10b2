"""Messages for Foxglove-compatible viewers (scene, robot, path, text) for every event of the loop."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import hypot
from typing import final

from foxglove_schemas_protobuf.Log_pb2 import Log
from google.protobuf.message import Message

from recorders.foxglove import scene as foxglove_scene
from workbench.execution.events import (
    ActionEnded,
    BeliefUpdated,
    ContainerObserved,
    Event,
    PlanMade,
    RunEnded,
    RunStatus,
)
from workbench.log_schema.place import Place
from workbench.planning.plans import PlanStatus
from workbench.planning.tasks import Task, goal_types
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import START, ItemType, LocationId
from workbench.worlds.names import readable_name
from workbench.worlds.travel import Paths

ViewerMessage = tuple[str, Message, int]
"""Topic, message, log time in nanoseconds."""

MAP, SCENE, TF, POSE, PATH, LOG = "/map", "/viz/scene", "/tf", "/robot/pose", "/robot/path", "/log"
LATCHED = (MAP, SCENE, TF)
"""Channels whose last message is repeated at the start of every part of a split log."""
POSE_EVERY_M = 0.5
"""Largest distance in metres between poses along a path; corners always have one."""


@final
class ViewerMessages:
    """Builds viewer messages and keeps the state of the scene: last belief, searched containers, item sought.

    Args:
        paths: paths between locations; by default those of the place.
        motion: derive the robot's pose from its actions.
    """

    def __init__(self, place: Place, task: Task, *, paths: Paths | None = None, motion: bool = True) -> None:
        self._place = place
        self._paths = paths or place.paths()
        self._motion = motion
        self._searched: dict[str, tuple[str, ...]] = {}
        self._believed: BeliefUpdated | None = None
        self._sought = (*goal_types(task.goal), ItemType(""))[0]
        self._title = task.title or task.scenario

    def opening(self, stamp_ns: int) -> Iterator[ViewerMessage]:
        """The initial messages: map, scene and robot pose."""
        if self._place.occupancy is not None:
            yield MAP, foxglove_scene.map_grid(self._place.occupancy, stamp_ns), stamp_ns
        yield SCENE, foxglove_scene.scene(self._place.plan, stamp_ns), stamp_ns
        if self._motion:
            yield from self._robot(self._place.standing.get(START, self._place.plan.start), stamp_ns)
        yield LOG, foxglove_scene.words(f"Task: {self._title}", stamp_ns), stamp_ns

    def messages_for(self, event: Event) -> Iterator[ViewerMessage]:
        """The viewer messages of one event, sorted by stamp."""
        match event:
            case ContainerObserved():
                yield from self._observed(event)
            case BeliefUpdated():
                self._believed = event
            case PlanMade():
                yield from self._planned(event)
            case ActionEnded():
                yield from self._acted(event)
            case RunEnded():
                level = Log.INFO if event.status is RunStatus.DONE else Log.WARNING
                text = f"Ended: {event.status.value}, cost {event.cost:.1f} ({event.reason})"
                yield LOG, foxglove_scene.words(text, event.stamp_ns, level=level), event.stamp_ns
                yield SCENE, self._scene(event.stamp_ns), event.stamp_ns
            case _:
                pass

    def _observed(self, event: ContainerObserved) -> Iterator[ViewerMessage]:
        self._searched[event.container] = tuple(item.type for item in event.items)
        if not event.known_at_start:
            held = ", ".join(readable_name(item.type) for item in event.items) or "nothing"
            yield LOG, foxglove_scene.words(f"{event.container} holds {held}", event.stamp_ns), event.stamp_ns

    def _planned(self, event: PlanMade) -> Iterator[ViewerMessage]:
        stamp, plan = event.stamp_ns, event.made.plan
        finds = [step for step in plan.steps if step.action == "find"]
        if finds:
            self._sought = finds[0].item_types[0]
        steps = "; ".join(str(step) for step in plan.steps) or plan.note or "no steps"
        end = f"expected {plan.cost:.1f}" if plan.status is PlanStatus.SOLVED else plan.status.value
        text = f"Decision {event.decision} ({event.reason}): {steps}; {end}"
        yield LOG, foxglove_scene.words(text, stamp), stamp
        yield SCENE, self._scene(stamp), stamp
        yield PATH, foxglove_scene.path_ahead(self._ahead(event), stamp), stamp

    def _ahead(self, event: PlanMade) -> list[Point]:
        """The path ahead: to the first stop of the plan's find, and on through its targets."""
        stops = [event.robot_at]
        for step in event.made.plan.steps:
            if step.action == "find" and event.made.search_order and step is _first_find(event):
                stops.append(LocationId(event.made.search_order[0].container))
            stops.append(step.target)
        points: list[Point] = []
        for a, b in pairwise(stops):
            path = self._paths.path(a, b) if a != b else None
            points.extend(path or ())
        return points

    def _acted(self, event: ActionEnded) -> Iterator[ViewerMessage]:
        if self._motion:
            for pose, stamp in poses_along(event):
                yield from self._robot(pose, stamp)
        if not event.success:
            text = f"{event.step} failed: {event.reason}"
            yield LOG, foxglove_scene.words(text, event.stamp_ns, level=Log.WARNING), event.stamp_ns

    def _robot(self, pose: Pose, stamp_ns: int) -> Iterator[ViewerMessage]:
        yield TF, foxglove_scene.robot_transforms(pose, stamp_ns), stamp_ns
        yield POSE, foxglove_scene.robot_pose(pose, stamp_ns), stamp_ns

    def _scene(self, stamp_ns: int) -> Message:
        belief = None if self._believed is None else self._believed.belief
        probability: dict[str, float] = {}
        if belief is not None and self._sought in belief.item_types:
            row = belief.probability[list(belief.item_types).index(self._sought)]
            probability = dict(zip(belief.containers, (float(p) for p in row), strict=True))
        return foxglove_scene.scene(
            self._place.plan, stamp_ns, sought=self._sought, probability=probability, searched=self._searched
        )


def poses_along(event: ActionEnded) -> Iterator[tuple[Pose, int]]:
    """The robot's poses during an action, with stamps interpolated by distance."""
    points = [*event.path[:1], *(p for a, b in pairwise(event.path) for p in _between(a, b))]
    poses = foxglove_scene.facing(points)
    gone = [0.0]
    for a, b in pairwise(points):
        gone.append(gone[-1] + hypot(b[0] - a[0], b[1] - a[1]))
    for pose, metres in zip(poses, gone, strict=False):
        share = metres / gone[-1] if gone[-1] > 0 else 1.0
        yield pose, event.start_ns + round((event.stamp_ns - event.start_ns) * share)
    if event.standing is not None:
        yield event.standing, event.stamp_ns


def _between(a: Point, b: Point) -> list[Point]:
    """Points after a up to b, at most POSE_EVERY_M apart."""
    count = max(1, int(hypot(b[0] - a[0], b[1] - a[1]) / POSE_EVERY_M + 0.999))
    return [(a[0] + (b[0] - a[0]) * k / count, a[1] + (b[1] - a[1]) * k / count) for k in range(1, count + 1)]


def _first_find(event: PlanMade) -> object:
    return next(step for step in event.made.plan.steps if step.action == "find")
