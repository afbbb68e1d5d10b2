"""Paths between locations, recomputed from the occupancy grid and standing poses of a log.

They are computed by the same code as the robot's navigation, so that a replay follows the same corner points. A
path is a straight line if the log has no grid, or if a standing pose is not on a free cell (a place whose map was
measured in another way).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from math import hypot
from typing import final

import numpy as np

from workbench.arrays import Bools, Floats
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import LocationId
from workbench.worlds.maps.navigation import Navigation, free_cells
from workbench.worlds.maps.occupancy import OccupancyGrid
from workbench.worlds.travel import TravelCosts


@final
class LoggedPaths:
    """Paths of a logged place; implements `Paths`."""

    def __init__(
        self,
        standing: Mapping[LocationId, Pose],
        travel: TravelCosts,
        occupancy: OccupancyGrid | None,
        robot_radius_m: float,
    ) -> None:
        self._standing = standing
        self._travel = travel
        self._occupancy = occupancy
        self._robot_radius_m = robot_radius_m

    def standing_pose(self, location: LocationId) -> Pose | None:
        return self._standing.get(location)

    def path(self, a: LocationId, b: LocationId) -> tuple[Point, ...] | None:
        """Corner points from a to b, both ends included; None if one of them is unreachable."""
        start, end = self._standing.get(a), self._standing.get(b)
        if start is None or end is None:
            return None
        path = None if self._navigation is None else self._navigation.path(a, b)
        return (start.point, end.point) if path is None else path

    def path_from(self, point: Point, location: LocationId) -> tuple[Point, ...] | None:
        """Corner points from a point of a path to a location, both ends included; None if it is unreachable."""
        end = self._standing.get(location)
        if end is None:
            return None
        path = None if self._navigation is None else self._navigation.path_from(point, location)
        return (point, end.point) if path is None else path

    def metres_from(self, point: Point) -> Floats:
        """Travel costs in metres from a point of a path to every location; float64, shape (locations,)."""
        known = self._navigation
        if known is not None and all(location in known.standing for location in self._travel.locations):
            return known.metres_from(point)
        ends = [self._standing[location].point for location in self._travel.locations]
        return np.array([hypot(x - point[0], y - point[1]) for x, y in ends])

    @cached_property
    def _navigation(self) -> Navigation | None:
        """The navigation, computed on first use."""
        grid = self._occupancy
        if grid is None:
            return None
        free = free_cells(grid, self._robot_radius_m)
        on_free = {name: pose for name, pose in self._standing.items() if _is_free(grid, free, pose)}
        return Navigation(travel=self._travel, grid=grid, free=free, standing=on_free)


def _is_free(grid: OccupancyGrid, free: Bools, pose: Pose) -> bool:
    row, column = grid.cell_at(pose.point)
    return 0 <= row < free.shape[0] and 0 <= column < free.shape[1] and bool(free[row, column])
