"""Spots on a piece of furniture for the marks of items, side by side on its top."""

from __future__ import annotations

from math import ceil, cos, sin, sqrt

import numpy as np

from workbench.arrays import Floats32
from workbench.worlds.house import Container

MARK_M, MIN_MARK_M = 0.1, 0.03
"""Diameter of an item's mark: where there is room, and at least."""
INSET = 0.8
"""Share of the top's width and depth that the marks use."""
MIN_SIDE_M = 0.15


def item_spots(container: Container, count: int) -> tuple[Floats32, float]:
    """Centres of marks in metres on the map, float32 (count, 3), in rows; and the diameter that fits."""
    wide, deep = (max(side * INSET, MIN_SIDE_M) for side in container.size_m[:2])
    columns = max(1, min(count, ceil(sqrt(count * wide / deep))))
    rows = max(1, ceil(count / columns))
    size_m = max(MIN_MARK_M, min(MARK_M, 0.9 * wide / columns, 0.9 * deep / rows))
    number = np.arange(count)
    x = ((number % columns + 0.5) / columns - 0.5) * wide
    y = ((number // columns + 0.5) / rows - 0.5) * deep
    pose, top_m = container.pose, container.base_m + container.size_m[2] + size_m / 2
    c, s = cos(pose.yaw_rad), sin(pose.yaw_rad)
    at = np.column_stack([pose.x_m + c * x - s * y, pose.y_m + s * x + c * y, np.full(count, top_m)])
    return at.astype(np.float32), size_m
