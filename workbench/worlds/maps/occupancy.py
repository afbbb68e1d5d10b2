"""Occupancy grids of floor plans: walls, furniture, and everything outside the rooms."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, hypot

import numpy as np

from workbench.arrays import Bools, Floats, Ints32
from workbench.errors import BadValue
from workbench.tolerances import MIN_LENGTH_M, ROUNDING
from workbench.worlds.geometry import Point
from workbench.worlds.house import Container, FloorPlan, Furniture, Wall

MARGIN_M = 0.3
"""Width in metres of the occupied margin around the rooms."""
ROBOT_HEIGHT_M = 1.0
"""Objects above this height in metres are no obstacle."""
STEP_OVER_M = 0.03
"""Objects below this height in metres are no obstacle."""
MAX_CELLS = 4_000_000
"""Largest grid: 200 m by 200 m at 0.1 m. Larger ones are taken as a mistake of units."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OccupancyGrid:
    """An occupancy grid of the floor.

    Attributes:
        origin: the outer corner of cell (0, 0) in the map frame, least x and least y.
        resolution_m: a cell's side.
        occupied: bool, shape (rows along y, columns along x), read-only. True: wall, furniture, or outside.
    """

    origin: Point
    resolution_m: float
    occupied: Bools

    def __post_init__(self) -> None:
        occupied = np.array(self.occupied, dtype=np.bool_)
        if occupied.ndim != 2 or occupied.size == 0:
            raise BadValue("occupancy grid", occupied.shape, "of rows and columns")
        if not self.resolution_m > 0:
            raise BadValue("resolution of the occupancy grid", self.resolution_m, "more than 0 m")
        occupied.flags.writeable = False
        object.__setattr__(self, "occupied", occupied)

    def cell_at(self, point: Point) -> tuple[int, int]:
        """(row, column) of a point; may be outside the grid."""
        x = (point[0] - self.origin[0]) / self.resolution_m
        y = (point[1] - self.origin[1]) / self.resolution_m
        return int(np.floor(y)), int(np.floor(x))

    def point_at(self, row: int, column: int) -> Point:
        """The centre of a cell in the map frame."""
        return (
            self.origin[0] + (column + 0.5) * self.resolution_m,
            self.origin[1] + (row + 0.5) * self.resolution_m,
        )

    def axes(self) -> tuple[Floats, Floats]:
        """x of the column centres and y of the row centres, in metres."""
        rows, columns = self.occupied.shape
        x = self.origin[0] + (np.arange(columns) + 0.5) * self.resolution_m
        y = self.origin[1] + (np.arange(rows) + 0.5) * self.resolution_m
        return x, y


def occupancy_of(plan: FloorPlan, *, resolution_m: float = 0.1) -> OccupancyGrid:
    """The occupancy grid of a floor plan, with interior doors and open walls free.

    Raises:
        BadValue: a resolution that is not positive, or a house beyond MAX_CELLS cells.
    """
    grid = walls_of(plan, resolution_m=resolution_m)
    occupied = np.array(grid.occupied)
    for thing in (*plan.containers, *plan.furniture):
        if thing.base_m < ROBOT_HEIGHT_M and thing.base_m + thing.size_m[2] > STEP_OVER_M:
            distance, window = distance_to_box(grid, thing, reach_m=0.0)
            occupied[window] |= distance <= 0
    return OccupancyGrid(origin=grid.origin, resolution_m=resolution_m, occupied=occupied)


def walls_of(plan: FloorPlan, *, resolution_m: float = 0.1) -> OccupancyGrid:
    """The walls of a floor plan and everything outside its rooms, without furniture: what blocks the view.

    Raises:
        BadValue: as occupancy_of.
    """
    grid = _empty_grid(plan, resolution_m)
    occupied = room_labels(plan, grid) < 0
    for wall in plan.walls:
        if not wall.empty:
            for start, end in solid_parts(wall, plan):
                _draw_segment(occupied, grid, start, end)
    return OccupancyGrid(origin=grid.origin, resolution_m=resolution_m, occupied=occupied)


def room_labels(plan: FloorPlan, grid: OccupancyGrid) -> Ints32:
    """The index of the room of each cell, -1 outside; shape (rows, columns)."""
    x, y = grid.axes()
    labels = np.full(grid.occupied.shape, -1, dtype=np.int32)
    for index, room in enumerate(plan.rooms):
        corners = np.array(room.floor)
        low, high = np.searchsorted(x, [corners[:, 0].min(), corners[:, 0].max()])
        within = np.zeros((len(y), high - low), dtype=np.bool_)
        for (x0, y0), (x1, y1) in zip(np.roll(corners, 1, axis=0), corners, strict=True):
            first, last = np.searchsorted(y, sorted((y0, y1)))
            if first < last:
                at_x = x0 + (x1 - x0) / (y1 - y0) * (y[first:last] - y0)
                within[first:last] ^= at_x[:, None] > x[None, low:high]
        part = labels[:, low:high]
        part[within & (part < 0)] = index
    return labels


def solid_parts(wall: Wall, plan: FloorPlan) -> list[tuple[Point, Point]]:
    """The pieces of a wall between the holes of its passable doors."""
    (x0, y0), (x1, y1) = wall.start, wall.end
    length = hypot(x1 - x0, y1 - y0)
    if length < MIN_LENGTH_M:
        return []
    holes: list[tuple[float, float]] = []
    for door in plan.doors:
        if door.passable:
            along, off = zip(*(_along_and_off(wall, length, end) for end in (door.start, door.end)), strict=True)
            if max(off) < 0.1 and max(along) > 0 and min(along) < length:
                holes.append((max(0.0, min(along)), min(length, max(along))))
    pieces: list[tuple[float, float]] = []
    reached = 0.0
    for low, high in sorted(holes):
        if low > reached:
            pieces.append((reached, low))
        reached = max(reached, high)
    if reached < length:
        pieces.append((reached, length))

    def at(t: float) -> Point:
        return (x0 + (x1 - x0) * t / length, y0 + (y1 - y0) * t / length)

    return [(at(low), at(high)) for low, high in pieces]


def distance_to_box(
    grid: OccupancyGrid, thing: Container | Furniture, *, reach_m: float
) -> tuple[Floats, tuple[slice, slice]]:
    """Distances in metres from cells to the footprint of an object (0 inside), in the window of cells
    within reach."""
    pose, (depth, width, _) = thing.pose, thing.size_m
    c, s = np.cos(pose.yaw_rad), np.sin(pose.yaw_rad)
    half_x = abs(c) * depth / 2 + abs(s) * width / 2 + reach_m
    half_y = abs(s) * depth / 2 + abs(c) * width / 2 + reach_m
    rows, columns = grid.occupied.shape
    row0, column0 = grid.cell_at((pose.x_m - half_x, pose.y_m - half_y))
    row1, column1 = grid.cell_at((pose.x_m + half_x, pose.y_m + half_y))
    window = (
        slice(min(max(row0, 0), rows), min(max(row1 + 1, 0), rows)),
        slice(min(max(column0, 0), columns), min(max(column1 + 1, 0), columns)),
    )
    x, y = grid.axes()
    dx, dy = x[window[1]][None, :] - pose.x_m, y[window[0]][:, None] - pose.y_m
    along = np.maximum(np.abs(c * dx + s * dy) - depth / 2, 0.0)
    across = np.maximum(np.abs(c * dy - s * dx) - width / 2, 0.0)
    return np.hypot(along, across), window


def _empty_grid(plan: FloorPlan, resolution_m: float) -> OccupancyGrid:
    if not 0.005 <= resolution_m <= 10:
        raise BadValue("resolution_m", resolution_m, "from 0.005 to 10 m")
    corners = np.array([corner for room in plan.rooms for corner in room.floor], dtype=np.float64)
    low, high = corners.min(axis=0) - MARGIN_M, corners.max(axis=0) + MARGIN_M
    columns, rows = (max(1, ceil(float(side) / resolution_m)) for side in high - low)
    if rows * columns > MAX_CELLS:
        side = f"{high[0] - low[0]:.0f} m by {high[1] - low[1]:.0f} m"
        raise BadValue(
            f"extent of {plan.name}", side, f"at most {MAX_CELLS} cells of {resolution_m} m; check the units"
        )
    empty = np.zeros((rows, columns), dtype=np.bool_)
    return OccupancyGrid(origin=(float(low[0]), float(low[1])), resolution_m=resolution_m, occupied=empty)


def _along_and_off(wall: Wall, length: float, point: Point) -> tuple[float, float]:
    """The position of a point relative to a wall: metres along it from its start, and metres off its line."""
    (x0, y0), (x1, y1) = wall.start, wall.end
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    dx, dy = point[0] - x0, point[1] - y0
    return (dx * ux + dy * uy, abs(dy * ux - dx * uy))


def _draw_segment(occupied: Bools, grid: OccupancyGrid, start: Point, end: Point) -> None:
    """Mark the cells whose centres are within half a cell of a segment."""
    half = grid.resolution_m / 2
    row0, column0 = grid.cell_at((min(start[0], end[0]) - half, min(start[1], end[1]) - half))
    row1, column1 = grid.cell_at((max(start[0], end[0]) + half, max(start[1], end[1]) + half))
    rows, columns = slice(max(row0, 0), max(row1 + 1, 0)), slice(max(column0, 0), max(column1 + 1, 0))
    x, y = grid.axes()
    dx, dy = x[columns][None, :] - start[0], y[rows][:, None] - start[1]
    ux, uy = end[0] - start[0], end[1] - start[1]
    square = ux * ux + uy * uy
    t = np.clip((dx * ux + dy * uy) / square, 0.0, 1.0) if square > 0 else np.zeros(1)
    occupied[rows, columns] |= np.hypot(dx - t * ux, dy - t * uy) <= half + ROUNDING
