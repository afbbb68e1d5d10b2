"""Occupancy grids whose rows are not along the map's x axis, laid out along it."""

from __future__ import annotations

from math import ceil, cos, sin

import numpy as np

from workbench.arrays import Bools, Ints8
from workbench.errors import BadValue
from workbench.tolerances import MIN_ANGLE_RAD, MIN_LENGTH_M
from workbench.worlds.geometry import Point
from workbench.worlds.maps.occupancy import OccupancyGrid

OCCUPIED_FROM = 50
"""Least value of nav_msgs/OccupancyGrid (0 to 100) that counts as occupied."""
MAX_GROWTH = 4
"""Largest factor by which turning may add cells; a thin diagonal strip beyond it is refused."""


def is_occupied(values: Ints8) -> Bools:
    """Occupied cells of an OccupancyGrid's values: OCCUPIED_FROM or more, and unknown (negative)."""
    return (values >= OCCUPIED_FROM) | (values < 0)


def axis_aligned(occupied: Bools, *, origin: Point, yaw_rad: float, resolution_m: float) -> OccupancyGrid:
    """The grid of cells whose first corner is at origin and whose rows are turned by yaw_rad (ROS: origin's yaw).

    Each new cell takes the value of the old cell in which its centre lies, and is occupied outside: unsurveyed space.
    Turns by right angles are exact.

    Args:
        occupied: shape (rows, columns), row 0 at the origin.

    Raises:
        BadValue: a thin diagonal strip, whose axis-aligned box is too large.
    """
    if abs(yaw_rad) < MIN_ANGLE_RAD:
        return OccupancyGrid(origin=origin, resolution_m=resolution_m, occupied=np.ascontiguousarray(occupied))
    rows, columns = occupied.shape
    c, s = cos(yaw_rad), sin(yaw_rad)
    corners = np.array([(0, 0), (columns, 0), (columns, rows), (0, rows)], dtype=np.float64)
    turned = np.stack([c * corners[:, 0] - s * corners[:, 1], s * corners[:, 0] + c * corners[:, 1]], axis=1)
    low, high = turned.min(axis=0), turned.max(axis=0)
    wide, tall = (max(1, ceil(float(side) - MIN_LENGTH_M)) for side in high - low)
    if wide * tall > MAX_GROWTH * max(rows * columns, 1_000_000):
        raise BadValue("extent of the turned map", f"{wide} x {tall} cells", "a less narrow map; save it with yaw 0")
    x = float(low[0]) + np.arange(wide)[None, :] + 0.5
    y = float(low[1]) + np.arange(tall)[:, None] + 0.5
    column = np.floor(c * x + s * y).astype(np.int64)
    row = np.floor(c * y - s * x).astype(np.int64)
    inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
    result = np.ones((tall, wide), dtype=np.bool_)
    result[inside] = occupied[row[inside], column[inside]]
    return OccupancyGrid(
        origin=(origin[0] + float(low[0]) * resolution_m, origin[1] + float(low[1]) * resolution_m),
        resolution_m=resolution_m,
        occupied=result,
    )
