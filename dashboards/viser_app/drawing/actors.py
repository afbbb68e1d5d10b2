"""Draws the runs in a house: each one's robot, the path behind it and the path ahead, in its colour."""

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
from dashboards.palette import Colour
from workbench.arrays import Floats32
from workbench.worlds.geometry import Point

TRAIL_M = 0.02
"""Height of trails above the floor; the run in focus is on top."""
TOGETHER_M = 0.5
"""A ghost this close to the run in focus has no name tag: the names would overlap."""
GHOSTS_TOGETHER_M, MAX_TOGETHER = 1.0, 3
"""Ghosts this close to one another share one name tag, with this many names at most."""
BESIDE_M, GHOST_BESIDE_M = 1.6, 0.8
"""A robot this close to a numbered container has no name tag either: the number matters more. Ghosts' tags are
higher."""


@dataclass(slots=True)
class _RobotActor:
    """The moving parts of one run."""

    frame: viser.FrameHandle
    trail: viser.LineSegmentsHandle
    ahead: viser.LineSegmentsHandle
    label: viser.LabelHandle
    name: str
    height_m: float
    here: bool
    pose: tuple[float, float, float] | None = None
    ahead_shown: Floats32 | None = None

    def parts(self) -> tuple[viser.SceneNodeHandle, ...]:
        return (self.frame, self.trail, self.ahead)

    def show(self, scene: Scene) -> None:
        robot = scene.robot
        pose = (robot.x_m, robot.y_m, robot.yaw_rad)
        if self.pose != pose:
            self.frame.position = (robot.x_m, robot.y_m, 0.0)
            self.frame.wxyz = (cos(robot.yaw_rad / 2), 0.0, 0.0, sin(robot.yaw_rad / 2))
            self.pose = pose
            _set_points(self.trail, path_segments(scene.trail, scene.imputed, self.height_m))
        ahead = dashes(scene.ahead, self.height_m + 0.004)
        if self.ahead_shown is None or not np.array_equal(self.ahead_shown, ahead):
            _set_points(self.ahead, ahead)
            self.ahead_shown = ahead


@final
class Actors:
    """The runs in one browser's view; the first is in focus."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._actors: list[_RobotActor] = []

    def set_runs(self, colours: Sequence[Colour], names: Sequence[str], here: Sequence[bool]) -> None:
        """Creates as many actors as there are runs, in their colours.

        Args:
            here: for each run, whether it is of the place that is shown; others are not drawn.
        """
        for actor in self._actors:
            for part in actor.parts():
                part.remove()
        self._actors = [
            self._actor(i, colour, name, here=is_here)
            for i, (colour, name, is_here) in enumerate(zip(colours, names, here, strict=True))
        ]

    def show(self, scenes: Sequence[Scene], numbered: Sequence[Point]) -> None:
        """Shows one moment of every run.

        Args:
            numbered: positions of the numbers of the order of search.
        """
        tags: list[tuple[_RobotActor, RobotState, list[str]]] = []
        for i, (actor, scene) in enumerate(zip(self._actors, scenes, strict=False)):
            actor.show(scene)
            others = [(p, GHOST_BESIDE_M if i else BESIDE_M) for p in numbered]
            if i:
                others.append(((scenes[0].robot.x_m, scenes[0].robot.y_m), TOGETHER_M))
            alone = not any(_apart(scene.robot, point) <= near for point, near in others)
            wanted = actor.here and alone and len(self._actors) > 1
            together = next((t for t in tags if i and _apart(scene.robot, _point(t[1])) <= GHOSTS_TOGETHER_M), None)
            if wanted and together is not None:
                together[2].append(actor.name)
            elif wanted:
                tags.append((actor, scene.robot, [actor.name]))
            actor.label.visible = wanted and together is None
        for actor, _, names in tags:
            words = ", ".join(names[:MAX_TOGETHER]) + (" ..." if len(names) > MAX_TOGETHER else "")
            if actor.label.text != words:
                actor.label.text = words

    def _actor(self, index: int, colour: Colour, name: str, *, here: bool) -> _RobotActor:
        root = f"/runs/{index}"
        ghost = 0.4 if index else None
        frame = self._scene.add_frame(f"{root}/robot", show_axes=False, visible=here)
        for part, mesh, paint in (("body", robot_body(), colour), ("legs", robot_legs(), ROBOT_DARK)):
            self._scene.add_mesh_simple(
                f"{root}/robot/{part}", *mesh, color=paint, flat_shading=True, opacity=ghost, cast_shadow=not index
            )
        nothing = np.zeros((1, 2, 3), dtype=np.float32)
        thick = 0.05 if index == 0 else 0.035
        return _RobotActor(
            frame=frame,
            trail=self._scene.add_line_segments(f"{root}/trail", nothing, colour, thickness=thick, visible=here),
            ahead=self._scene.add_line_segments(
                f"{root}/ahead", nothing, colour, thickness=thick * 0.7, visible=here
            ),
            label=self._scene.add_label(
                f"{root}/robot/label",
                label_words(name),
                position=(0, 0, 0.95 + 0.35 * index),
                anchor="bottom-center",
                font_screen_scale=0.8,
                visible=False,
            ),
            name=label_words(name),
            height_m=TRAIL_M + 0.012 * max(1, 6 - index),
            here=here,
        )


def _apart(robot: RobotState, point: Point) -> float:
    return hypot(robot.x_m - point[0], robot.y_m - point[1])


def _point(robot: RobotState) -> Point:
    return robot.x_m, robot.y_m


def _set_points(handle: viser.LineSegmentsHandle, points: Floats32) -> None:
    handle.points = points if len(points) else np.zeros((1, 2, 3), dtype=np.float32)
