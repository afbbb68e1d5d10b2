"""Solids, the elements of a scene: boxes, cylinders and balls, each a scaled and turned copy of one unit shape.

All of a house's solids of one shape form one batch, so that a viewer draws a house with three instanced meshes
instead of thousands of objects. A solid of a container carries the container's index, so that a change of belief
changes one array of colours.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import cos, sin
from typing import Literal

import numpy as np

from dashboards.palette import Colour
from workbench.arrays import Bools, Floats32, Ints32, Uints8, Uints32
from workbench.worlds.geometry import Pose

Shape = Literal["box", "cylinder", "ball"]
SHAPES: tuple[Shape, ...] = ("box", "cylinder", "ball")
NO_OWNER = -1
"""The owner of a solid that belongs to no container."""


@dataclass(frozen=True, slots=True)
class Solid:
    """One unit shape, scaled to size_m, turned by yaw about z and centred; owner is a container's index."""

    shape: Shape
    centre: tuple[float, float, float]
    size_m: tuple[float, float, float]
    yaw_rad: float = 0.0
    colour: Colour = (255, 255, 255)
    owner: int = NO_OWNER

    def placed(self, pose: Pose, base_m: float) -> Solid:
        """The solid, given in a body's frame, in the map frame."""
        c, s = cos(pose.yaw_rad), sin(pose.yaw_rad)
        x, y, z = self.centre
        return Solid(
            self.shape,
            (pose.x_m + c * x - s * y, pose.y_m + s * x + c * y, base_m + z),
            self.size_m,
            pose.yaw_rad + self.yaw_rad,
            self.colour,
            self.owner,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """All solids of one shape as arrays over N instances.

    Attributes:
        centre: float32 (N, 3). size_m: float32 (N, 3). yaw_rad: float32 (N,).
        colour: uint8 (N, 3). owner: int32 (N,), a container's index or NO_OWNER.
    """

    shape: Shape
    centre: Floats32
    size_m: Floats32
    yaw_rad: Floats32
    colour: Uints8
    owner: Ints32

    def wxyz(self) -> Floats32:
        """Turns as quaternions in Viser's order (w, x, y, z), shape (N, 4)."""
        half = self.yaw_rad / 2
        zero = np.zeros_like(half)
        return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=1).astype(np.float32)

    def where(self, chosen: Bools) -> Batch:
        """Some of the solids, chosen by a mask of shape (N,)."""
        return Batch(
            shape=self.shape,
            centre=self.centre[chosen],
            size_m=self.size_m[chosen],
            yaw_rad=self.yaw_rad[chosen],
            colour=self.colour[chosen],
            owner=self.owner[chosen],
        )

    def coloured(self, of_owner: Uints8) -> Uints8:
        """Colours with each owned solid in its owner's colour (of_owner: (owners, 3)), shape (N, 3)."""
        colours = self.colour.copy()
        owned = self.owner >= 0
        colours[owned] = of_owner[self.owner[owned]]
        return colours


def batches(solids: Iterable[Solid]) -> tuple[Batch, ...]:
    """The solids grouped by shape, in the order of SHAPES; shapes without solids are left out."""
    found = tuple(solids)
    made: list[Batch] = []
    for shape in SHAPES:
        mine = [solid for solid in found if solid.shape == shape]
        if mine:
            made.append(
                Batch(
                    shape=shape,
                    centre=np.array([s.centre for s in mine], dtype=np.float32),
                    size_m=np.array([s.size_m for s in mine], dtype=np.float32),
                    yaw_rad=np.array([s.yaw_rad for s in mine], dtype=np.float32),
                    colour=np.array([s.colour for s in mine], dtype=np.uint8),
                    owner=np.array([s.owner for s in mine], dtype=np.int32),
                )
            )
    return tuple(made)


def unit_mesh(shape: Shape) -> tuple[Floats32, Uints32]:
    """Vertices (V, 3) and faces (F, 3) of the unit shape, centred, of size 1 in x, y and z.

    Corners of the box are doubled per face, so that smooth shading keeps its edges.
    """
    if shape == "box":
        return _unit_box()
    if shape == "cylinder":
        return _unit_cylinder(24)
    return _unit_ball(16, 10)


def small_ball() -> tuple[Floats32, Uints32]:
    """The unit ball with few faces, for marks of which there may be hundreds."""
    return _unit_ball(10, 6)


def _unit_box() -> tuple[Floats32, Uints32]:
    vertices: list[tuple[float, float, float]] = []
    faces: list[tuple[int, int, int]] = []
    for axis in range(3):
        for side in (-0.5, 0.5):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
            first = len(vertices)
            for a, b in corners if side > 0 else corners[::-1]:
                point = [0.0, 0.0, 0.0]
                point[axis], point[u], point[v] = side, a, b
                vertices.append((point[0], point[1], point[2]))
            faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return np.array(vertices, dtype=np.float32), np.array(faces, dtype=np.uint32)


def _unit_cylinder(n: int) -> tuple[Floats32, Uints32]:
    turn = np.linspace(0, 2 * np.pi, n, endpoint=False)
    ring = np.stack([np.cos(turn) / 2, np.sin(turn) / 2], axis=1)
    low = np.column_stack([ring, np.full(n, -0.5)])
    high = np.column_stack([ring, np.full(n, 0.5)])
    ends = np.array([[0, 0, -0.5], [0, 0, 0.5]])
    vertices = np.concatenate([low, high, low, high, ends]).astype(np.float32)
    faces: list[tuple[int, int, int]] = []
    for i in range(n):
        j = (i + 1) % n
        faces += [(i, j, n + j), (i, n + j, n + i)]
        faces += [(4 * n, 2 * n + j, 2 * n + i), (4 * n + 1, 3 * n + i, 3 * n + j)]
    return vertices, np.array(faces, dtype=np.uint32)


def _unit_ball(around: int, up: int) -> tuple[Floats32, Uints32]:
    rows = [
        (np.sin(t) * np.cos(p) / 2, np.sin(t) * np.sin(p) / 2, -np.cos(t) / 2)
        for t in np.linspace(0, np.pi, up + 1)
        for p in np.linspace(0, 2 * np.pi, around, endpoint=False)
    ]
    faces: list[tuple[int, int, int]] = []
    for i in range(up):
        for j in range(around):
            a, b = i * around + j, i * around + (j + 1) % around
            c, d = a + around, b + around
            faces += [(a, b, d), (a, d, c)]
    return np.array(rows, dtype=np.float32), np.array(faces, dtype=np.uint32)
