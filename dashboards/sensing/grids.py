"""Cells of local grids where the robot cannot stand, as flat squares on the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from dashboards.sensing.clouds import NUMBERS
from dashboards.sensing.frames import Frames, matrix
from workbench.arrays import Bools, Floats, Floats32, Uints32

HEIGHT_M = 0.03
NEAR_M = 0.3
"""Closer to an obstacle than this counts as near."""
BLOCKED, NEAR = (178, 60, 40), (226, 170, 120)
OCCUPIED_SHARE = 50
"""Cells of an occupancy grid with at least this value (of 100) are blocked."""
MAX_CELLS = 250_000


@dataclass(frozen=True, slots=True, kw_only=True)
class GridCells:
    """Squares on the floor.

    Attributes:
        vertices: float32 (4 n, 3), four to a cell; faces: uint32 (2 n, 3).
        blocked: for each cell, whether it is an obstacle (True) or only near one (False), bool (n,).
    """

    vertices: Floats32
    faces: Uints32
    blocked: Bools

    def faces_of(self, chosen: Bools) -> Uints32:
        """The faces of some cells, uint32 (2 m, 3)."""
        return self.faces[np.tile(chosen, 2)]


def grid_cells(message: Any, frames: Frames, stamp_ns: int) -> GridCells | None:
    """The blocked and near cells of a foxglove.Grid; None when it cannot be read or placed, or all is free.

    A field named like a distance holds metres to the nearest obstacle (Spot's obstacle_distance: at most 0 inside an
    obstacle); any other holds an occupancy from 0 to 100.
    """
    values = _values(message)
    pose = matrix(message.pose.position, message.pose.orientation) if message.HasField("pose") else np.eye(4)
    map_from_frame = frames.on_map(message.frame_id, stamp_ns)
    if values is None or pose is None or map_from_frame is None:
        return None
    distance = "distance" in message.fields[0].name
    blocked = values <= 0 if distance else values >= OCCUPIED_SHARE
    shown = values < NEAR_M if distance else blocked
    rows, columns = np.nonzero(shown & np.isfinite(values))
    if not len(rows):
        return None
    wide, high = message.cell_size.x, message.cell_size.y
    corners = [(columns + dx, rows + dy) for dx, dy in ((0, 0), (1, 0), (1, 1), (0, 1))]
    flat = np.stack([np.column_stack([x * wide, y * high, np.zeros(len(x))]) for x, y in corners], axis=1)
    whole = map_from_frame @ pose
    points = flat.reshape(-1, 3) @ whole[:3, :3].T + whole[:3, 3]
    points[:, 2] = HEIGHT_M
    first = 4 * np.arange(len(rows))[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    return GridCells(
        vertices=points.astype(np.float32), faces=faces.astype(np.uint32), blocked=blocked[rows, columns]
    )


def _values(message: Any) -> Floats | None:
    """The first field's values, shape (rows, columns); None where bytes and claims disagree."""
    field = message.fields[0] if message.fields else None
    kind = np.dtype(NUMBERS[field.type]) if field is not None and field.type in NUMBERS else None
    columns, row, cell = message.column_count, message.row_stride, message.cell_stride
    if field is None or kind is None or not columns or not cell or row < columns * cell:
        return None
    rows = len(message.data) // row
    if field.offset + kind.itemsize > cell or not 0 < rows * columns <= MAX_CELLS:
        return None
    table = np.frombuffer(message.data, dtype=np.uint8, count=rows * row).reshape(rows, row)[:, : columns * cell]
    packed = table.reshape(rows, columns, cell)[:, :, field.offset : field.offset + kind.itemsize]
    return np.ascontiguousarray(packed).view(kind)[:, :, 0].astype(np.float64)
