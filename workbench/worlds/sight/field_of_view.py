"""The part of the floor that a robot sees from one point: its sight radius to all sides, cut off by walls.

The walls are those of LinesOfSight, sampled in the same way: what is outside the rooms counts as wall, furniture
hides nothing and open doors let the view pass.
"""

from __future__ import annotations

from functools import cached_property
from typing import final

import numpy as np

from workbench.arrays import Floats
from workbench.worlds.geometry import Point
from workbench.worlds.house import FloorPlan
from workbench.worlds.maps.occupancy import OccupancyGrid, walls_of
from workbench.worlds.sight.lines_of_sight import checked_radius, in_walls

RAYS = 180


@final
class FieldOfView:
    """The fields of view in one floor plan.

    Args:
        radius_m: how far the robot sees, in metres.

    Raises:
        BadValue: no sight radius.
    """

    def __init__(self, plan: FloorPlan, radius_m: float) -> None:
        self.radius_m = checked_radius(radius_m)
        self._plan = plan

    @cached_property
    def walls(self) -> OccupancyGrid:
        """What blocks the view."""
        return walls_of(self._plan)

    @property
    def steps(self) -> int:
        """Samples along a ray, half a cell apart; none beyond the grid's diagonal."""
        grid = self.walls
        farthest_m = min(self.radius_m, float(np.hypot(*grid.occupied.shape)) * grid.resolution_m)
        return max(1, int(np.ceil(2 * farthest_m / grid.resolution_m)))

    def outline(self, point: Point) -> Floats:
        """The ends of RAYS rays from a point, counter-clockwise from +x, in metres on the map; float64 (RAYS, 2).

        A ray ends at the radius, or at the first sample in a wall. The robot's own cell blocks nothing.
        """
        grid, steps = self.walls, self.steps
        along_m = np.minimum(np.arange(1, steps + 1) * grid.resolution_m / 2, self.radius_m)
        turn = np.arange(RAYS) * (2 * np.pi / RAYS)
        ray_x = point[0] + np.cos(turn)[:, None] * along_m
        ray_y = point[1] + np.sin(turn)[:, None] * along_m
        wall = in_walls(grid, ray_x, ray_y, free=point)
        end = np.where(wall.any(axis=1), wall.argmax(axis=1), steps - 1)
        ray = np.arange(RAYS)
        return np.stack([ray_x[ray, end], ray_y[ray, end]], axis=1)
