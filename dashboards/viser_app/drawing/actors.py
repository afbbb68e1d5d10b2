"""Draws the runs in a house: each one's robot, the path behind it and the path ahead, in its colour.

All ghosts together are three objects of few faces, so that many runs play about as fast as few.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot
from typing import final

import numpy as np
import viser

from dashboards.geometry.marks import (
    ROBOT_DARK,
    dashed,
    path_segments,
    robot_body,
    robot_ghost,
    robot_legs,
    segments,
    uncovered,
)
from dashboards.model.labels import label as label_words
from dashboards.model.scene import RobotState, Scene
from dashboards.palette import Colour, linear_rgb, run_number
from dashboards.viser_app.drawing.instances import Instances
from dashboards.viser_app.drawing.ribbons import Ribbons
from workbench.arrays import Floats32, Uints8
from workbench.worlds.geometry import Point

TRAIL_M = 0.02
"""Height of trails above the floor; the run in focus is on top."""
THICK_M, GHOST_THICK_M = 0.05, 0.035
AHEAD_UP_M = 0.004
"""Height of the planned path above the trail of the same run."""
GHOST_OPACITY = 0.4
SAME_PLACE_M = 0.05
"""Of robots this close to one another only the first is drawn."""
TOGETHER_M = 0.5
"""A ghost this close to the run in focus has no name tag: the names would overlap."""
GHOSTS_TOGETHER_M, MAX_TOGETHER = 1.0, 3
"""Ghosts this close to one another share one name tag, with this many names at most."""
BESIDE_M, GHOST_BESIDE_M = 1.6, 0.8
"""A robot this close to a numbered container has no name tag either: the number matters more. Ghosts' tags are
higher."""


@dataclass(frozen=True, slots=True)
class _Actor:
    """One run: its colour, its name tag, and whether it is of the place that is shown."""

    index: int
    colour: Colour
    name: str
    label: viser.LabelHandle
    here: bool

    @property
    def path_m(self) -> float:
        """Height of its trail."""
        return TRAIL_M + 0.012 * max(1, 6 - self.index)

    @property
    def tag_m(self) -> float:
        return 0.95 + 0.35 * self.index


class _Lines:
    """Line segments in the colours of runs."""

    def __init__(self, scene: viser.SceneApi, name: str, thick_m: float) -> None:
        nothing = np.zeros((1, 2, 3), dtype=np.float32)
        paint = np.zeros((1, 2, 3), dtype=np.uint8)
        self._handle = scene.add_line_segments(name, nothing, paint, thickness=thick_m, visible=False)

    def show(self, points: Floats32, paint: Uints8) -> None:
        """Shows segments (n, 2, 3) in linear colours (n, 3); what does not change is not sent."""
        if not len(points):
            self._handle.visible = False
            return
        self._handle.points = points
        self._handle.colors = paint[:, None].repeat(2, axis=1)
        self._handle.visible = True

    def remove(self) -> None:
        self._handle.remove()


class _Group:
    """Robots and paths that are drawn together: the run in focus, or all ghosts."""

    def __init__(self, scene: viser.SceneApi, name: str, actors: Sequence[_Actor], *, ghosts: bool) -> None:
        self._actors = [actor for actor in actors if actor.here]
        room, opacity = len(self._actors), GHOST_OPACITY if ghosts else None
        thick_m, lines = (GHOST_THICK_M, Ribbons) if ghosts else (THICK_M, _Lines)
        body = robot_ghost() if ghosts else robot_body()
        self._bodies = Instances(scene, f"{name}/bodies", body, capacity=room, opacity=opacity)
        self._legs = None if ghosts else Instances(scene, f"{name}/legs", robot_legs(), capacity=room)
        self._trails = lines(scene, f"{name}/trails", thick_m)
        self._ahead = lines(scene, f"{name}/ahead", thick_m * 0.7)
        self._first = self._actors[0].index if self._actors else 0
        self._shown: object = None

    def show(self, scenes: Sequence[Scene]) -> None:
        drawn = [(actor, scenes[actor.index]) for actor in self._actors if actor.index < len(scenes)]
        seen = _in_sight([(actor, s.robot) for actor, s in drawn], before=scenes[: self._first])
        shown = ([s.robot for _, s in drawn], [actor.index for actor, _ in seen])
        if shown != self._shown:
            self._shown = shown
            at = np.array([(robot.x_m, robot.y_m, 0.0) for _, robot in seen], dtype=np.float32).reshape(-1, 3)
            half = np.array([robot.yaw_rad / 2 for _, robot in seen], dtype=np.float32)
            turns = np.column_stack([np.cos(half), *[np.zeros_like(half)] * 2, np.sin(half)])
            self._bodies.show(at, _linear([actor.colour for actor, _ in seen]), wxyzs=turns)
            if self._legs is not None:
                self._legs.show(at, _linear([ROBOT_DARK] * len(at)), wxyzs=turns)
            trails = [(path_segments(s.trail, s.imputed, actor.path_m), actor.colour) for actor, s in drawn]
            self._trails.show(*_joined(trails))
        lines, paint = _joined([(segments(s.ahead, actor.path_m + AHEAD_UP_M), actor.colour) for actor, s in drawn])
        dashes, of_line = dashed(lines)
        self._ahead.show(dashes, paint[of_line])

    def remove(self) -> None:
        for part in (self._bodies, self._legs, self._trails, self._ahead):
            if part is not None:
                part.remove()


@final
class Actors:
    """The runs in one browser's view; the first is in focus."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._actors: list[_Actor] = []
        self._groups: list[_Group] = []

    def set_runs(self, colours: Sequence[Colour], names: Sequence[str], here: Sequence[bool]) -> None:
        """Creates as many actors as there are runs, in their colours; the tags of many hold their numbers only.

        Args:
            here: for each run, whether it is of the place that is shown; others are not drawn.
        """
        for part in (*self._groups, *(actor.label for actor in self._actors)):
            part.remove()
        self._actors = [
            self._actor(i, colour, run_number(i, len(names)) or name, here=is_here)
            for i, (colour, name, is_here) in enumerate(zip(colours, names, here, strict=True))
        ]
        parts = (("focus", self._actors[:1], False), ("ghosts", self._actors[1:], True))
        self._groups = [_Group(self._scene, f"/runs/{n}", some, ghosts=g) for n, some, g in parts if some]

    def show(self, scenes: Sequence[Scene], numbered: Sequence[Point]) -> None:
        """Shows one moment of every run.

        Args:
            numbered: positions of the numbers of the order of search.
        """
        for group in self._groups:
            group.show(scenes)
        tags: list[tuple[_Actor, RobotState, list[str]]] = []
        for i, (actor, scene) in enumerate(zip(self._actors, scenes, strict=False)):
            others = [(p, GHOST_BESIDE_M if i else BESIDE_M) for p in numbered]
            if i:
                others.append((_point(scenes[0].robot), TOGETHER_M))
            alone = not any(_apart(scene.robot, point) <= near for point, near in others)
            wanted = actor.here and alone and len(self._actors) > 1
            together = next((t for t in tags if i and _apart(scene.robot, _point(t[1])) <= GHOSTS_TOGETHER_M), None)
            if wanted and together is not None:
                together[2].append(actor.name)
            elif wanted:
                tags.append((actor, scene.robot, [actor.name]))
            shown = wanted and together is None
            if actor.label.visible != shown:
                actor.label.visible = shown
        for actor, robot, names in tags:
            words = ", ".join(names[:MAX_TOGETHER]) + (" ..." if len(names) > MAX_TOGETHER else "")
            if run_number(actor.index, len(self._actors)):
                words = f"{'run' if len(names) == 1 else 'runs'} {words}"  # other numbers are the order of search
            if actor.label.text != words:
                actor.label.text = words
            actor.label.position = (robot.x_m, robot.y_m, actor.tag_m)

    def _actor(self, index: int, colour: Colour, name: str, *, here: bool) -> _Actor:
        label = self._scene.add_label(
            f"/runs/tags/{index}",
            label_words(name),
            anchor="bottom-center",
            font_screen_scale=0.8,
            visible=False,
        )
        return _Actor(index=index, colour=colour, name=label_words(name), label=label, here=here)


def _joined(parts: Sequence[tuple[Floats32, Colour]]) -> tuple[Floats32, Uints8]:
    """The segments of all runs, (n, 2, 3), and the linear colour of each, (n, 3).

    Of segments with the same two ends on the map only the first is kept, which hides the others: strategies that
    agree walk the same way.
    """
    points = np.concatenate([np.zeros((0, 2, 3), dtype=np.float32), *(points for points, _ in parts)])
    paint = np.repeat(_linear([c for _, c in parts]), [len(p) for p, _ in parts], axis=0)
    first = uncovered(points)
    return points[first], paint[first]


def _linear(colours: Sequence[Colour]) -> Uints8:
    return linear_rgb(np.array(colours, dtype=np.uint8).reshape(-1, 3))


def _in_sight(
    robots: Sequence[tuple[_Actor, RobotState]], before: Sequence[Scene]
) -> list[tuple[_Actor, RobotState]]:
    """The robots that stand where none before them stands: one drawn through another would only blur it."""
    taken = [scene.robot for scene in before[:1]]
    seen: list[tuple[_Actor, RobotState]] = []
    for actor, robot in robots:
        if not any(abs(robot.x_m - r.x_m) + abs(robot.y_m - r.y_m) < SAME_PLACE_M for r in taken):
            taken.append(robot)
            seen.append((actor, robot))
    return seen


def _apart(robot: RobotState, point: Point) -> float:
    return hypot(robot.x_m - point[0], robot.y_m - point[1])


def _point(robot: RobotState) -> Point:
    return robot.x_m, robot.y_m
