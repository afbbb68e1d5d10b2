"""Shortest paths through a surveyed place, on its occupancy map inflated by the robot's radius.

Travel costs are 8-connected lengths on the grid (docs/worlds.md). What is walked is the same way with its corners
cut where the straight line is free, so a little shorter than it costs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2, ceil
from types import MappingProxyType
from typing import final

import numpy as np

from workbench.arrays import Bools
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import START, Container, FloorPlan, LocationId
from workbench.worlds.maps.navigation import free_cells
from workbench.worlds.maps.occupancy import OccupancyGrid, distance_to_box, room_labels
from workbench.worlds.travel import TravelCosts

Cell = tuple[int, int]

REACH_M = 1.2
"""Largest distance in metres of a container's edge from the nearest free cell; beyond it, the container is
unreachable."""
APART_M, OTHERS = 0.7, 2
"""How far another standing place at a container is from those before, in metres, and how many of them are found."""
SNAP_M = 0.6
"""Largest distance in metres of a surveyed pose from the nearest free cell, since maps and surveys differ by some
cells."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class SiteNavigation:
    """Paths between standing poses and between any two points. Implements Paths.

    Attributes:
        grid: the map.
        free: cells for the robot's centre, bool, shape (rows, columns).
        standing: the robot's pose at each reachable location.
        travel: travel costs in metres between all of them.
    """

    grid: OccupancyGrid
    free: Bools
    standing: Mapping[LocationId, Pose]
    travel: TravelCosts

    def path(self, a: LocationId, b: LocationId) -> tuple[Point, ...] | None:
        if a not in self.standing or b not in self.standing:
            return None
        return self.path_between(self.standing[a].point, self.standing[b].point)

    def standing_pose(self, location: LocationId) -> Pose | None:
        return self.standing.get(location)

    def path_between(self, a: Point, b: Point) -> tuple[Point, ...] | None:
        """The path between any two points, both included; None if there is none."""
        from workbench.worlds.maps.shortest_paths import shortest_path

        start, end = nearest_free(self.grid, self.free, a), nearest_free(self.grid, self.free, b)
        if start is None or end is None:
            return None
        columns = self.free.shape[1]
        cells = shortest_path(self.free, start[0] * columns + start[1], end[0] * columns + end[1])
        if cells is None:
            return None
        return (a, *(self.grid.point_at(*cell) for cell in _cut_corners(self.free, cells)[1:-1]), b)


def find_paths(
    plan: FloorPlan, grid: OccupancyGrid, *, robot_radius_m: float, stand: Mapping[LocationId, Pose]
) -> SiteNavigation:
    """Standing poses, travel costs and paths of a site on its map.

    Args:
        plan: rooms, containers and the start pose.
        grid: occupied cells.
        robot_radius_m: inflation of obstacles in metres.
        stand: surveyed standing poses; the others are computed on the free floor of the container's room.
    """
    from workbench.worlds.maps.shortest_paths import pairwise_steps

    free = free_cells(grid, robot_radius_m)
    rooms = room_labels(plan, grid)
    poses: dict[LocationId, Pose] = {START: plan.start}
    for container in plan.containers:
        place = LocationId(container.id)
        number = next(i for i, room in enumerate(plan.rooms) if room.id == container.room)
        pose = stand.get(place) or _approach(grid, free & (rooms == number), container)
        if pose is not None:
            poses[place] = pose
    cells = {name: nearest_free(grid, free, pose.point) for name, pose in poses.items()}
    reached = {name: cell for name, cell in cells.items() if cell is not None} if cells[START] is not None else {}
    flat = np.array([row * free.shape[1] + column for row, column in reached.values()], dtype=np.int64)
    return SiteNavigation(
        grid=grid,
        free=free,
        standing=MappingProxyType({name: poses[name] for name in reached}),
        travel=TravelCosts(
            locations=tuple(reached),
            metres=pairwise_steps(free, flat) * grid.resolution_m,
            unreachable=tuple(c.id for c in plan.containers if c.id not in reached),
        ),
    )


def other_standing_poses(
    navigation: SiteNavigation, plan: FloorPlan, container: Container, here: Point
) -> tuple[Pose, ...]:
    """Other poses at a container than where the robot stands, best first: on free floor of the container's room, each
    APART_M from the others, and with a path to it.

    Args:
        here: where the robot stands.
    """
    rooms = room_labels(plan, navigation.grid)
    free = navigation.free & (rooms == next(i for i, room in enumerate(plan.rooms) if room.id == container.room))
    x, y = navigation.grid.axes()
    found: list[Pose] = []
    while len(found) < OTHERS:
        for at in (here, *(pose.point for pose in found[-1:])):
            free &= np.hypot(x[None, :] - at[0], y[:, None] - at[1]) >= APART_M
        pose = _approach(navigation.grid, free, container)
        if pose is None:
            break
        found.append(pose)
    return tuple(pose for pose in found if navigation.path_between(here, pose.point) is not None)


def nearest_free(grid: OccupancyGrid, free: Bools, point: Point) -> Cell | None:
    """The free cell nearest to a point; None if none is within reach."""
    row, column = grid.cell_at(point)
    reach = ceil(SNAP_M / grid.resolution_m)
    top, left = max(0, row - reach), max(0, column - reach)
    rows, columns = np.nonzero(free[top : max(0, row + reach + 1), left : max(0, column + reach + 1)])
    if rows.size == 0:
        return None
    best = int(np.argmin(np.hypot(rows + top - row, columns + left - column)))
    return (int(rows[best]) + top, int(columns[best]) + left)


def is_free_line(free: Bools, a: Cell, b: Cell) -> bool:
    """Whether every cell on the straight line between two cells is free."""
    count = 2 * max(abs(b[0] - a[0]), abs(b[1] - a[1])) + 1
    rows = np.rint(np.linspace(a[0], b[0], count)).astype(np.int64)
    columns = np.rint(np.linspace(a[1], b[1], count)).astype(np.int64)
    return bool(free[rows, columns].all())


def _approach(grid: OccupancyGrid, free: Bools, container: Container) -> Pose | None:
    """The free cell nearest to the container's edge and middle, facing the middle.

    Distance from the centre counts half as much as distance from the edge, since the arm reaches forward.
    """
    distance, window = distance_to_box(grid, container, reach_m=REACH_M)
    allowed = free[window] & (distance <= REACH_M)
    if not allowed.any():
        return None
    x, y = grid.axes()
    off = np.hypot(x[window[1]][None, :] - container.pose.x_m, y[window[0]][:, None] - container.pose.y_m)
    rank = np.where(allowed, np.round(distance + 0.5 * off, 6), np.inf)
    row, column = np.unravel_index(int(np.argmin(rank)), rank.shape)
    at = grid.point_at(int(row) + window[0].start, int(column) + window[1].start)
    yaw = atan2(container.pose.y_m - at[1], container.pose.x_m - at[0])
    return Pose(x_m=at[0], y_m=at[1], yaw_rad=yaw)


def _cut_corners(free: Bools, cells: list[Cell]) -> list[Cell]:
    """The path reduced to corners: from each corner to the farthest cell along a free straight line."""
    corners, at = [cells[0]], 0
    while at < len(cells) - 1:
        ahead, step = at + 1, max(1, (len(cells) - 1 - at) // 2)
        while step:
            if ahead + step < len(cells) and is_free_line(free, cells[at], cells[ahead + step]):
                ahead += step
            else:
                step //= 2
        corners.append(cells[ahead])
        at = ahead
    return corners
