"""Line segments as flat ribbons on the floor, all of them copies of one mesh.

Without a graphics card a line costs several times what a ribbon costs: Viser draws each as six triangles, twice, to
smooth its edges, and a ribbon is two.
"""

from __future__ import annotations

from typing import final

import numpy as np
import viser

from dashboards.viser_app.drawing.instances import Instances
from workbench.arrays import Floats32, Uints8

EXPECTED = 256
"""For how many segments there is room at first."""
_CORNERS = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0.5, 0.5, 0], [-0.5, 0.5, 0]], dtype=np.float32)
_FACES = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.uint32)


@final
class Ribbons:
    """Level line segments, each as wide as it is told, seen from above."""

    def __init__(self, scene: viser.SceneApi, name: str, wide_m: float) -> None:
        self._wide_m = wide_m
        self._quads = Instances(scene, name, (_CORNERS, _FACES), capacity=EXPECTED)

    def show(self, points: Floats32, paint: Uints8) -> None:
        """Shows segments (n, 2, 3) in linear colours (n, 3)."""
        along = points[:, 1, :2] - points[:, 0, :2]
        half = np.arctan2(along[:, 1], along[:, 0]) / 2
        nothing, wide = np.zeros_like(half), np.full_like(half, self._wide_m)
        self._quads.show(
            points.mean(axis=1),
            paint,
            scales=np.column_stack([np.hypot(*along.T) + self._wide_m, wide, np.ones_like(half)]).astype(np.float32),
            wxyzs=np.column_stack([np.cos(half), nothing, nothing, np.sin(half)]).astype(np.float32),
        )

    def remove(self) -> None:
        self._quads.remove()
