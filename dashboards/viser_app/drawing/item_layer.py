"""Draws the items that were seen as small balls on their furniture."""

from __future__ import annotations

from typing import final

import numpy as np
import viser

from dashboards.geometry.solids import small_ball
from dashboards.model.containers.item_marks import MAX_NAMES, ItemMarks
from dashboards.palette import GOAL, ITEM, linear_rgb
from dashboards.viser_app.drawing.instances import Instances

USUAL_COUNT = 32
NAME_SCALE = 0.72
"""Size of an item's name, as a share of a room's."""


@final
class ItemLayer:
    """The marks of items in one house; all are one instanced mesh."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._balls = Instances(scene, "/items/balls", small_ball(), capacity=USUAL_COUNT)
        self._shown: ItemMarks | None = None
        self._names: list[viser.LabelHandle] = []

    def show(self, marks: ItemMarks) -> None:
        """Shows the items of one moment; what did not change is not sent."""
        if self._same(marks):
            return
        self._shown = marks
        colours = np.where(marks.wanted[:, None], np.array(GOAL), np.array(ITEM)).astype(np.uint8)
        self._balls.show(marks.centre, linear_rgb(colours), scales=marks.size_m[:, None].repeat(3, axis=1))
        self._show_names(marks)

    def remove(self) -> None:
        self._balls.remove()
        for handle in self._names:
            handle.remove()
        self._names, self._shown = [], None

    def _same(self, marks: ItemMarks) -> bool:
        before = self._shown
        if before is None:
            return not len(marks.centre)
        return (
            before.names == marks.names
            and np.array_equal(before.centre, marks.centre)
            and np.array_equal(before.wanted, marks.wanted)
        )

    def _show_names(self, marks: ItemMarks) -> None:
        while len(self._names) < min(len(marks.names), MAX_NAMES):
            self._names.append(
                self._scene.add_label(
                    f"/items/names/{len(self._names)}",
                    "",
                    visible=False,
                    anchor="bottom-center",
                    font_screen_scale=NAME_SCALE,
                )
            )
        for i, label in enumerate(self._names):
            named = i < len(marks.names)
            if named:
                label.text, label.position = marks.names[i]
            if label.visible != named:
                label.visible = named
