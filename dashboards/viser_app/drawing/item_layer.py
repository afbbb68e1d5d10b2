"""Draws the items that were seen as small balls on their furniture, and frames the places of the goal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
import viser

from dashboards.geometry.marks import Mesh
from dashboards.geometry.solids import unit_mesh
from dashboards.model.containers.item_marks import MAX_NAMES, ItemMarks
from dashboards.palette import GOAL, ITEM, linear_rgb

MIN_CAPACITY = 32
SPECK = 1e-4
"""The scale of instances that are not shown; viewers do not accept 0."""
NAME_SCALE = 0.72
"""Size of an item's name, as a share of a room's."""


@final
class ItemLayer:
    """The marks of items in one house; all are one instanced mesh.

    Args:
        frames: one mesh for each place of the goal.
    """

    def __init__(self, scene: viser.SceneApi, frames: Sequence[Mesh]) -> None:
        self._scene = scene
        self._balls: viser.BatchedMeshHandle | None = None
        self._capacity = 0
        self._shown: ItemMarks | None = None
        self._names: list[viser.LabelHandle] = []
        self._frames = [
            scene.add_mesh_simple(f"/goal/{i}", *frame, color=GOAL, flat_shading=True, cast_shadow=False)
            for i, frame in enumerate(frames)
        ]

    def show(self, marks: ItemMarks) -> None:
        """Shows the items of one moment; what did not change is not sent."""
        if self._same(marks):
            return
        self._shown = marks
        count = len(marks.centre)
        if count > self._capacity:
            self._make_room(count)
        if self._balls is not None:
            centre = np.zeros((self._capacity, 3), dtype=np.float32)
            scale = np.full((self._capacity, 3), SPECK, dtype=np.float32)
            colour = np.zeros((self._capacity, 3), dtype=np.uint8)
            centre[:count], scale[:count] = marks.centre, marks.size_m[:, None]
            colour[:count] = np.where(marks.wanted[:, None], np.array(GOAL), np.array(ITEM)).astype(np.uint8)
            self._balls.batched_positions, self._balls.batched_scales = centre, scale
            self._balls.batched_colors = linear_rgb(colour)
        self._show_names(marks)

    def remove(self) -> None:
        for handle in (*([self._balls] if self._balls is not None else []), *self._names, *self._frames):
            handle.remove()
        self._balls, self._names, self._frames, self._shown, self._capacity = None, [], [], None, 0

    def _same(self, marks: ItemMarks) -> bool:
        before = self._shown
        if before is None:
            return not len(marks.centre)
        return (
            before.names == marks.names
            and np.array_equal(before.centre, marks.centre)
            and np.array_equal(before.wanted, marks.wanted)
        )

    def _make_room(self, count: int) -> None:
        """A larger mesh in place of the last; a new number of instances would be a new mesh all the same."""
        if self._balls is not None:
            self._balls.remove()
        self._capacity = max(MIN_CAPACITY, 1 << (count - 1).bit_length())
        self._balls = self._scene.add_batched_meshes_simple(
            "/items/balls",
            *unit_mesh("ball"),
            np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (self._capacity, 1)),
            np.zeros((self._capacity, 3), dtype=np.float32),
            batched_scales=np.full((self._capacity, 3), SPECK, dtype=np.float32),
            batched_colors=np.zeros((self._capacity, 3), dtype=np.uint8),
            lod="off",
            cast_shadow=False,
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
