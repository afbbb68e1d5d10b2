"""From where on the floor a robot sees a container: within the sight radius, with no wall between.

The robot looks to all sides, as one with cameras around its body does. Only walls and what is outside the rooms block
the view: furniture does not, and open doors let it pass. A container is seen where its centre is, and then wholly.
"""

from __future__ import annotations

from functools import cached_property
from math import isfinite
from typing import final

import numpy as np

from workbench.arrays import Bools, Floats
from workbench.errors import BadValue
from workbench.tolerances import ROUNDING
from workbench.worlds.geometry import Point
from workbench.worlds.house import Container, ContainerId, FloorPlan
from workbench.worlds.maps.occupancy import OccupancyGrid, walls_of
from workbench.worlds.sight.open_furniture import needs_no_opening

MAX_RADIUS_M = 100.0


def checked_radius(radius_m: float) -> float:
    """A sight radius in metres; 0 for a robot that sees nothing in passing.

    Raises:
        BadValue: negative, not a number, or beyond MAX_RADIUS_M.
    """
    if not isfinite(radius_m) or not 0 <= radius_m <= MAX_RADIUS_M:
        raise BadValue("sight radius (--sees)", radius_m, f"metres, from 0 to {MAX_RADIUS_M:g}")
    return radius_m


def in_walls(grid: OccupancyGrid, x_m: Floats, y_m: Floats, *, free: Point) -> Bools:
    """Whether each point blocks the view: it is in a wall or outside the grid, and not in the cell of `free`.

    Args:
        x_m, y_m: the points on the map, in metres; arrays of one shape, which is that of the result.
    """
    row = np.floor((y_m - grid.origin[1]) / grid.resolution_m).astype(np.int64)
    column = np.floor((x_m - grid.origin[0]) / grid.resolution_m).astype(np.int64)
    rows, columns = grid.occupied.shape
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    wall = grid.occupied[row.clip(0, rows - 1), column.clip(0, columns - 1)] | ~inside
    free_row, free_column = grid.cell_at(free)
    wall &= (row != free_row) | (column != free_column)
    return wall


@final
class LinesOfSight:
    """The lines of sight in one floor plan.

    Args:
        radius_m: how far the robot sees, in metres.

    Raises:
        BadValue: no sight radius.
    """

    def __init__(self, plan: FloorPlan, radius_m: float) -> None:
        self.radius_m = checked_radius(radius_m)
        self.open = tuple(c for c in plan.containers if needs_no_opening(c))
        self._plan = plan
        self._areas: dict[ContainerId, Bools] = {}

    def sees(self, container: Container, point: Point) -> bool:
        """Whether a robot at a point of the floor sees a container."""
        row, column = self._walls.cell_at(point)
        area = self.area(container)
        return 0 <= row < area.shape[0] and 0 <= column < area.shape[1] and bool(area[row, column])

    def area(self, container: Container) -> Bools:
        """The cells from which a container is seen; bool, shape of the grid of walls."""
        if container.id not in self._areas:
            self._areas[container.id] = self._area(container)
        return self._areas[container.id]

    @cached_property
    def _walls(self) -> OccupancyGrid:
        return walls_of(self._plan)

    def _area(self, container: Container) -> Bools:
        """Rays from each cell in range to the centre, sampled at every half cell; the centre's own cell is free."""
        grid, at = self._walls, container.pose.point
        x, y = grid.axes()
        dx, dy = np.meshgrid(x - at[0], y - at[1])
        seen = np.hypot(dx, dy) <= self.radius_m + ROUNDING
        rows, columns = np.nonzero(seen)
        steps = max(2, 2 * int(np.ceil(self.radius_m / grid.resolution_m)))
        along = np.linspace(0.0, 1.0, steps + 1)
        ray_x = at[0] + dx[rows, columns, None] * along
        ray_y = at[1] + dy[rows, columns, None] * along
        wall = in_walls(grid, ray_x, ray_y, free=at)
        seen[rows, columns] = ~wall.any(axis=1)
        seen.flags.writeable = False
        return seen
