"""The occupancy grid as a layer on the floor: runs of occupied cells in each row as rectangles, all in one mesh."""

from __future__ import annotations

import numpy as np

from dashboards.geometry.marks import Mesh
from workbench.arrays import Bools, Floats
from workbench.worlds.maps.occupancy import OccupancyGrid

HEIGHT_M = 0.014


def occupancy_mesh(grid: OccupancyGrid) -> Mesh | None:
    """The occupied cells from above, or None when all are free."""
    stretches = occupied_stretches(grid.occupied)
    if not len(stretches):
        return None
    x0, y0 = grid.origin
    row, first, end = stretches.T * grid.resolution_m
    corners = [(first, row), (end, row), (end, row + grid.resolution_m), (first, row + grid.resolution_m)]
    flat = [np.stack([x0 + x, y0 + y, np.full(len(x), HEIGHT_M)], axis=1) for x, y in corners]
    vertices = np.stack(flat, axis=1).reshape(-1, 3).astype(np.float32)
    start = 4 * np.arange(len(stretches))[:, None]
    faces = np.concatenate([start + np.array([0, 1, 2]), start + np.array([0, 2, 3])]).astype(np.uint32)
    return vertices, faces


def occupied_stretches(occupied: Bools) -> Floats:
    """Rows of (row, first column, column after the last) for every run of occupied cells."""
    padded = np.pad(occupied, ((0, 0), (1, 1))).astype(np.int8)
    change = np.diff(padded, axis=1)
    rows, first = np.nonzero(change == 1)
    _, end = np.nonzero(change == -1)
    return np.stack([rows, first, end], axis=1).astype(np.float64).reshape(-1, 3)
