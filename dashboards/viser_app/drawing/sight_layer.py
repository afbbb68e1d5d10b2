"""Draws the sight of the run in focus: its field of view, and from where it saw which container in passing.

Nothing is added to the view of a run that sees nothing in passing; what does not change is not sent.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
import viser

from dashboards.geometry.sight_marks import DOT_M, EYE_UP_M, dots_between, eye, field_mesh
from dashboards.geometry.solids import small_ball
from dashboards.model.perception.sight import PassingSight, seen_in_passing, sight_outline
from dashboards.model.scene import Scene
from dashboards.model.timeline import Timeline
from dashboards.palette import IN_SIGHT, SIGHT, linear_rgb
from dashboards.viser_app.drawing.instances import Instances
from workbench.arrays import Floats
from workbench.worlds.geometry import Point

FIELD_OPACITY = 0.4
OUTLINE_M = 0.03
USUAL_EYES, USUAL_DOTS = 16, 128


@final
class SightLayer:
    """The sight in one browser's view."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._tops: Sequence[tuple[float, float, float]] = ()
        self._field: viser.MeshHandle | None = None
        self._outline: viser.LineSegmentsHandle | None = None
        self._eyes: Instances | None = None
        self._dots: Instances | None = None
        self._from: Point | None = None
        self._passed: tuple[PassingSight, ...] = ()

    def open(self, tops_m: Sequence[tuple[float, float, float]]) -> None:
        """Begins again in a house, with the point over each container of its plan."""
        for part in (self._field, self._outline, self._eyes, self._dots):
            if part is not None:
                part.remove()
        self._field, self._outline, self._eyes, self._dots = None, None, None, None
        self._from, self._passed, self._tops = None, (), tops_m

    def show(self, timeline: Timeline, scene: Scene, *, visible: bool) -> None:
        """Shows the sight at one moment of a run."""
        here = (scene.robot.x_m, scene.robot.y_m)
        outline = sight_outline(timeline, here) if visible else None
        self._show_field(here, outline)
        self._show_passed(seen_in_passing(timeline, scene.stamp_ns) if visible else ())

    def _show_field(self, here: Point, outline: Floats | None) -> None:
        if outline is None:
            for part in (self._field, self._outline):
                if part is not None and part.visible:
                    part.visible = False
            self._from = None
            return
        if here == self._from:
            return
        self._from = here
        vertices, faces = field_mesh(here, outline)
        rim = np.stack([vertices[1:], np.roll(vertices[1:], -1, axis=0)], axis=1)
        if self._field is None or self._outline is None:
            self._field = self._scene.add_mesh_simple(
                "/sight/field",
                vertices,
                faces,
                color=IN_SIGHT,
                opacity=FIELD_OPACITY,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
            self._outline = self._scene.add_line_segments("/sight/outline", rim, SIGHT, thickness=OUTLINE_M)
        else:
            self._field.vertices, self._outline.points = vertices, rim
            self._field.visible = self._outline.visible = True

    def _show_passed(self, passed: tuple[PassingSight, ...]) -> None:
        if passed == self._passed:
            return
        self._passed = passed
        if self._eyes is None or self._dots is None:
            self._eyes = Instances(self._scene, "/sight/eyes", eye(), capacity=USUAL_EYES)
            self._dots = Instances(self._scene, "/sight/dots", small_ball(), capacity=USUAL_DOTS)
        eyes = np.array([(x, y, EYE_UP_M) for x, y in dict.fromkeys(p.viewpoint for p in passed)], dtype=np.float32)
        lines = [dots_between(np.array((*p.viewpoint, EYE_UP_M)), np.array(self._tops[p.container])) for p in passed]
        dots = np.concatenate([np.zeros((0, 3), dtype=np.float32), *lines])
        paint = linear_rgb(np.array([SIGHT], dtype=np.uint8))
        self._eyes.show(eyes.reshape(-1, 3), paint.repeat(len(eyes), axis=0))
        self._dots.show(
            dots, paint.repeat(len(dots), axis=0), scales=np.full((len(dots), 3), DOT_M, dtype=np.float32)
        )
