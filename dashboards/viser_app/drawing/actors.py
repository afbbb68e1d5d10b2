"""Draws the runs in a house: each one's robot, the path behind it and the path ahead, in its colour.

All ghosts together are four objects, as many as the run in focus has, so that many runs play about as fast as few.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, sin
from typing import final

import numpy as np
import viser

from dashboards.geometry.marks import ROBOT_DARK, dashes, path_segments, robot_body, robot_legs
from dashboards.model.labels import label as label_words
from dashboards.model.scene import RobotState, Scene
from dashboards.palette import Colour, linear_rgb
from dashboards.viser_app.drawing.instances import Instances
from workbench.arrays import Floats32, Uints8
from workbench.worlds.geometry import Point

TRAIL_M = 0.02
"""Height of trails above the floor; the run in focus is on top."""
THICK_M, GHOST_THICK_M = 0.05, 0.035
GHOST_OPACITY = 0.4
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

    def show(self, parts: Sequence[tuple[Floats32, Colour]]) -> None:
        """Shows segments (n, 2, 3) of each run; what does not change is not sent."""
        points = np.concatenate([np.zeros((0, 2, 3), dtype=np.float32), *(points for points, _ in parts)])
        if not len(points):
            self._handle.visible = False
            return
        paint = np.repeat(_linear([c for _, c in parts]), [len(p) for p, _ in parts], axis=0)
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
        thick_m = GHOST_THICK_M if ghosts else THICK_M
        self._bodies = Instances(scene, f"{name}/bodies", robot_body(), capacity=room, opacity=opacity)
        self._legs = Instances(scene, f"{name}/legs", robot_legs(), capacity=room, opacity=opacity)
        self._trails = _Lines(scene, f"{name}/trails", thick_m)
        self._ahead = _Lines(scene, f"{name}/ahead", thick_m * 0.7)
        self._poses: list[tuple[float, float, float]] | None = None

    def show(self, scenes: Sequence[Scene]) -> None:
        drawn = [(actor, scenes[actor.index]) for actor in self._actors if actor.index < len(scenes)]
        poses = [(s.robot.x_m, s.robot.y_m, s.robot.yaw_rad) for _, s in drawn]
        if poses != self._poses:
            self._poses = poses
            at = np.array([(x, y, 0.0) for x, y, _ in poses], dtype=np.float32).reshape(-1, 3)
            turns = np.array([(cos(a / 2), 0.0, 0.0, sin(a / 2)) for *_, a in poses], dtype=np.float32).reshape(-1, 4)
            self._bodies.show(at, _linear([actor.colour for actor, _ in drawn]), wxyzs=turns)
            self._legs.show(at, _linear([ROBOT_DARK] * len(at)), wxyzs=turns)
            self._trails.show([(path_segments(s.trail, s.imputed, a.path_m), a.colour) for a, s in drawn])
        self._ahead.show([(dashes(s.ahead, a.path_m + 0.004), a.colour) for a, s in drawn])

    def remove(self) -> None:
        for part in (self._bodies, self._legs, self._trails, self._ahead):
            part.remove()


@final
class Actors:
    """The runs in one browser's view; the first is in focus."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._actors: list[_Actor] = []
        self._groups: list[_Group] = []

    def set_runs(self, colours: Sequence[Colour], names: Sequence[str], here: Sequence[bool]) -> None:
        """Creates as many actors as there are runs, in their colours.

        Args:
            here: for each run, whether it is of the place that is shown; others are not drawn.
        """
        for part in (*self._groups, *(actor.label for actor in self._actors)):
            part.remove()
        self._actors = [
            self._actor(i, colour, name, here=is_here)
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


def _linear(colours: Sequence[Colour]) -> Uints8:
    return linear_rgb(np.array(colours, dtype=np.uint8).reshape(-1, 3))


def _apart(robot: RobotState, point: Point) -> float:
    return hypot(robot.x_m - point[0], robot.y_m - point[1])


def _point(robot: RobotState) -> Point:
    return robot.x_m, robot.y_m
