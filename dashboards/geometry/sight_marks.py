"""Marks of what a robot sees in passing: its field of view, an eye where it stood, dots to what it saw."""

from __future__ import annotations

import numpy as np

from dashboards.geometry.marks import Mesh
from workbench.arrays import Floats, Floats32
from workbench.worlds.geometry import Point

FIELD_UP_M = 0.016
"""Height of the field of view above the floor: over the occupancy map, under paths."""
EYE_UP_M = 0.5
"""Height of the eye at a viewpoint."""
DOT_M, DOTS_APART_M = 0.055, 0.2
"""Diameter of the dots from a viewpoint to what was seen, and their distance."""


def field_mesh(middle: Point, outline: Floats) -> Mesh:
    """The field of view as a fan about the robot.

    Args:
        outline: float64 (n, 2), counter-clockwise.
    """
    flat = np.concatenate([np.array([middle]), outline])
    around = np.arange(len(outline))
    faces = np.stack([np.zeros_like(around), around + 1, (around + 1) % len(outline) + 1], axis=1)
    up = np.full(len(flat), FIELD_UP_M)
    return np.column_stack([flat, up]).astype(np.float32), faces.astype(np.uint32)


def eye() -> Mesh:
    """An eye lying flat, 0.36 m wide: two lids and a pupil."""
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    lids = np.stack([np.cos(turn), 0.5 * np.sin(turn) * np.abs(np.sin(turn))], axis=1)
    outer, inner = lids * 0.18, lids * np.array([0.13, 0.115])
    i, j = np.arange(24), (np.arange(24) + 1) % 24
    rim = np.concatenate([np.stack([i, j, j + 24], axis=1), np.stack([i, j + 24, i + 24], axis=1)])
    pupil = np.stack([np.cos(turn), np.sin(turn)], axis=1) * 0.05
    disc = np.stack([np.full(22, 48), np.arange(49, 71), np.arange(50, 72)], axis=1)
    flat = np.concatenate([outer, inner, pupil])
    vertices = np.column_stack([flat, np.zeros(len(flat))]).astype(np.float32)
    return vertices, np.concatenate([rim, disc]).astype(np.uint32)


def dots_between(start: Floats, end: Floats) -> Floats32:
    """Dots on the line between two points (3,), the ends left out; float32 (n, 3)."""
    length = float(np.linalg.norm(end - start))
    count = max(1, int(length / DOTS_APART_M))
    share = np.arange(1, count + 1) / (count + 1)
    return (start + share[:, None] * (end - start)).astype(np.float32)
