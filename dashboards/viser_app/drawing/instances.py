"""Copies of one mesh in one browser's view, of which at each moment only those are drawn that are wanted.

On a machine without a graphics card every copy costs time even where it is too small to be seen; a mesh without any
is hidden.
"""

from __future__ import annotations

from typing import final

import numpy as np
import viser

from dashboards.geometry.marks import Mesh
from workbench.arrays import Floats32, Uints8

UPRIGHT = (1.0, 0.0, 0.0, 0.0)


@final
class Instances:
    """The copies of one mesh; none at first.

    Args:
        capacity: how many are expected at most; for more, the mesh is sent again.
        opacity: 0 to 1, of all; None is opaque.
    """

    def __init__(
        self, scene: viser.SceneApi, name: str, mesh: Mesh, *, capacity: int, opacity: float | None = None
    ) -> None:
        self._scene, self._name, self._shape, self._opacity = scene, name, mesh, opacity
        self._capacity = max(1, capacity)
        self._handle = self._add()

    def show(
        self, at: Floats32, colours: Uints8, *, scales: Floats32 | None = None, wxyzs: Floats32 | None = None
    ) -> None:
        """Draws these copies; what does not change is not sent.

        Args:
            at: in metres on the map, (n, 3).
            colours: linear RGB, (n, 3).
            scales: (n, 3); of size 1 without. wxyzs: (n, 4); upright without.
        """
        count = len(at)
        if not count:
            self._handle.visible = False
            return
        if count > self._capacity:
            self._handle.remove()
            self._capacity = 1 << (count - 1).bit_length()
            self._handle = self._add()
        self._handle.batched_positions = at
        self._handle.batched_wxyzs = _turns(count) if wxyzs is None else wxyzs
        self._handle.batched_scales = np.ones((count, 3), dtype=np.float32) if scales is None else scales
        self._handle.batched_colors = colours
        self._handle.visible = True

    def remove(self) -> None:
        self._handle.remove()

    def _add(self) -> viser.BatchedMeshHandle:
        """The mesh with room for all its copies, hidden."""
        room = self._capacity
        return self._scene.add_batched_meshes_simple(
            self._name,
            *self._shape,
            _turns(room),
            np.zeros((room, 3), dtype=np.float32),
            batched_scales=np.ones((room, 3), dtype=np.float32),
            batched_colors=np.zeros((room, 3), dtype=np.uint8),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
            opacity=self._opacity,
            visible=False,
        )


def _turns(count: int) -> Floats32:
    return np.tile(np.array(UPRIGHT, dtype=np.float32), (count, 1))
