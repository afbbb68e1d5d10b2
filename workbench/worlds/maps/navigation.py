"""Navigation in a floor plan: where the robot stands to use each container, and the paths and travel costs between.

A container is approached from its own room, since the nearest free cell may be behind a wall. Containers without a
free cell beside them are listed as unreachable. Results are cached on disk per floor plan (travel_cache.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot

import numpy as np

from workbench.arrays import Bools, Floats, Ints32
from workbench.caches import PerObject
from workbench.errors import BadValue, Malformed
from workbench.tolerances import ROUNDING
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import START, Container, ContainerId, FloorPlan, LocationId
from workbench.worlds.maps.clearance import distances_to, largest_part
from workbench.worlds.maps.occupancy import OccupancyGrid, distance_to_box, occupancy_of, room_labels
from workbench.worlds.maps.path_simplification import corner_cells
from workbench.worlds.maps.travel_cache import Arrays, load_arrays, store_arrays
from workbench.worlds.travel import TravelCosts

REACH_M = 1.0
"""Largest distance in metres from a container's edge at which the robot can use it."""


class NowhereToStand(Malformed):
    """No free floor is left for the robot."""

    def __init__(self, name: str, robot_radius_m: float) -> None:
        super().__init__(
            f"{name}: no floor is free for a robot of {robot_radius_m} m radius. Check units and furniture sizes."
        )


@dataclass(frozen=True, kw_only=True)
class Navigation:
    """Travel costs of a floor plan and the underlying paths. Implements Paths.

    Attributes:
        travel: travel costs in metres between all pairs of reachable locations.
        grid: the occupancy grid.
        free: bool, shape of the grid: where the robot's centre can be.
        standing: the robot's pose at each reachable location.
    """

    travel: TravelCosts
    grid: OccupancyGrid
    free: Bools
    standing: dict[LocationId, Pose]

    def standing_pose(self, location: LocationId) -> Pose | None:
        """The pose at which the robot uses a location, facing it; None if unreachable."""
        return self.standing.get(location)

    def path(self, a: LocationId, b: LocationId) -> tuple[Point, ...] | None:
        """Corner points from a to b, both included, with a length equal to the travel cost; None if there is no
        path."""
        if a not in self.standing or b not in self.standing:
            return None
        start, end = self.standing[a].point, self.standing[b].point
        return _PATHS.of(self).get((a, b), lambda: self._find_path(start, end))

    def path_from(self, point: Point, location: LocationId) -> tuple[Point, ...] | None:
        """Corner points from a point of a path to a location, both ends included; None if there is no way."""
        row, column = self.grid.cell_at(point)
        rows, columns = self.free.shape
        if location not in self.standing or not (
            0 <= row < rows and 0 <= column < columns and self.free[row, column]
        ):
            return None
        return self._find_path(point, self.standing[location].point)

    def metres_from(self, point: Point) -> Floats:
        """Travel costs in metres from a point of a path to every location; float64, shape (locations,)."""
        from workbench.worlds.maps.shortest_paths import distances_from

        columns = self.free.shape[1]
        cells = (self.grid.cell_at(self.standing[at].point) for at in self.travel.locations)
        flat = np.array([row * columns + column for row, column in cells], dtype=np.int64)
        row, column = self.grid.cell_at(point)
        return distances_from(self.free, row * columns + column, flat)[flat] * self.grid.resolution_m

    def _find_path(self, a: Point, b: Point) -> tuple[Point, ...]:
        from workbench.worlds.maps.shortest_paths import shortest_path

        columns = self.free.shape[1]
        (row_a, column_a), (row_b, column_b) = self.grid.cell_at(a), self.grid.cell_at(b)
        cells = shortest_path(self.free, row_a * columns + column_a, row_b * columns + column_b)
        if cells is None:
            raise AssertionError("reachable locations are connected")
        if len(cells) == 1:
            return (a, b)
        return tuple(self.grid.point_at(*cell) for cell in corner_cells(self.free, cells))


_PATHS: PerObject[tuple[LocationId, LocationId], tuple[Point, ...]] = PerObject(10_000)
"""Paths between locations, each found once."""


def navigate(plan: FloorPlan, *, resolution_m: float = 0.1, robot_radius_m: float = 0.2) -> Navigation:
    """Grid, standing poses and all-pairs travel costs of a floor plan.

    Args:
        resolution_m: side of a grid cell in metres.
        robot_radius_m: minimum distance in metres of the robot's centre from walls and furniture.

    Raises:
        BadValue: the house is too large for a grid, or a setting is out of range.
        NowhereToStand: no free floor is left.
    """
    if not 0 <= robot_radius_m <= 5:
        raise BadValue("robot_radius_m", robot_radius_m, "from 0 to 5 m")
    kept = load_arrays(plan, resolution_m=resolution_m, robot_radius_m=robot_radius_m)
    known = None if kept is None else _unpacked(plan, resolution_m, kept)
    if known is not None:
        return known
    navigation = compute(plan, resolution_m=resolution_m, robot_radius_m=robot_radius_m)
    store_arrays(_packed(navigation, plan), plan, resolution_m=resolution_m, robot_radius_m=robot_radius_m)
    return navigation


def compute(plan: FloorPlan, *, resolution_m: float, robot_radius_m: float) -> Navigation:
    """As navigate, without the cache."""
    from workbench.worlds.maps.shortest_paths import pairwise_steps

    grid = occupancy_of(plan, resolution_m=resolution_m)
    free = free_cells(grid, robot_radius_m)
    if not free.any():
        raise NowhereToStand(plan.name, robot_radius_m)
    start = _nearest_free(grid, free, plan.start.point)
    standing = {START: Pose(x_m=start[0], y_m=start[1], yaw_rad=plan.start.yaw_rad)}
    rooms = room_labels(plan, grid)
    room_index = {room.id: index for index, room in enumerate(plan.rooms)}
    unreachable: list[ContainerId] = []
    for container in plan.containers:
        pose = _approach(grid, free, rooms, room_index[container.room], container)
        if pose is None:
            unreachable.append(container.id)
        else:
            standing[LocationId(container.id)] = pose
    columns = free.shape[1]
    flat = [row * columns + column for row, column in (grid.cell_at(pose.point) for pose in standing.values())]
    metres = pairwise_steps(free, np.array(flat, dtype=np.int64)) * resolution_m
    travel = TravelCosts(locations=tuple(standing), metres=metres, unreachable=tuple(unreachable))
    return Navigation(travel=travel, grid=grid, free=free, standing=standing)


def free_cells(grid: OccupancyGrid, robot_radius_m: float) -> Bools:
    """The cells for the robot's centre: far enough from all obstacles, in the largest connected free component."""
    free = largest_part(clear_cells(grid, robot_radius_m))
    free.flags.writeable = False
    return free


def clear_cells(grid: OccupancyGrid, robot_radius_m: float) -> Bools:
    """The cells far enough from all obstacles for the robot's centre, connected or not; bool, shape of the grid."""
    needed = max(robot_radius_m, grid.resolution_m)
    away = distances_to(grid.occupied, within=needed / grid.resolution_m + 1)
    clear = np.asarray(away * grid.resolution_m >= needed - ROUNDING)
    clear[[0, -1], :] = False
    clear[:, [0, -1]] = False
    return clear


def _nearest_free(grid: OccupancyGrid, free: Bools, point: Point) -> Point:
    """The centre of the free cell nearest to a point."""
    rows, columns = np.nonzero(free)
    x, y = grid.axes()
    distance = np.hypot(x[columns] - point[0], y[rows] - point[1])
    best = int(np.argmin(np.round(distance, 9)))
    return grid.point_at(int(rows[best]), int(columns[best]))


def _approach(
    grid: OccupancyGrid,
    free: Bools,
    rooms: Ints32,
    room: int,
    container: Container,
) -> Pose | None:
    """The standing pose for a container: at the free cell of its room nearest to its edge, then nearest to its
    centre."""
    distance, window = distance_to_box(grid, container, reach_m=REACH_M)
    allowed = free[window] & (rooms[window] == room) & (distance <= REACH_M)
    if not allowed.any():
        return None
    x, y = grid.axes()
    dx = x[window[1]][None, :] - container.pose.x_m
    dy = y[window[0]][:, None] - container.pose.y_m
    rank = np.round(distance, 3) * 1e3 + np.hypot(dx, dy) * 1e-1
    row, column = np.unravel_index(int(np.argmin(np.where(allowed, rank, np.inf))), rank.shape)
    at = grid.point_at(int(row) + window[0].start, int(column) + window[1].start)
    to_x, to_y = container.pose.x_m - at[0], container.pose.y_m - at[1]
    yaw = atan2(to_y, to_x) if hypot(to_x, to_y) > 0 else 0.0
    return Pose(x_m=at[0], y_m=at[1], yaw_rad=yaw)


def _packed(navigation: Navigation, plan: FloorPlan) -> Arrays:
    """What the cache keeps of a navigation; containers as indices of the floor plan."""
    poses = [(pose.x_m, pose.y_m, pose.yaw_rad) for pose in navigation.standing.values()]
    order = {container.id: index for index, container in enumerate(plan.containers)}
    reachable = [order[c.id] for c in plan.containers if LocationId(c.id) in navigation.standing]
    return {
        "metres": navigation.travel.metres,
        "reachable": np.array(reachable, dtype=np.int64),
        "standing": np.array(poses, dtype=np.float64),
        "occupied": np.packbits(navigation.grid.occupied),
        "free": np.packbits(navigation.free),
        "shape": np.array(navigation.free.shape, dtype=np.int64),
        "origin": np.array(navigation.grid.origin, dtype=np.float64),
    }


def _unpacked(plan: FloorPlan, resolution_m: float, kept: Arrays) -> Navigation | None:
    """The navigation that _packed gave these arrays; None where they are not such."""
    try:
        return _navigation(plan, resolution_m, kept)
    except (ValueError, KeyError, IndexError):
        return None


def _navigation(plan: FloorPlan, resolution_m: float, kept: Arrays) -> Navigation:
    rows, columns = (int(side) for side in kept["shape"])

    def bits(name: str) -> Bools:
        return np.unpackbits(kept[name], count=rows * columns).reshape(rows, columns).astype(np.bool_)

    reached = [plan.containers[index].id for index in kept["reachable"].tolist()]
    locations = (START, *(LocationId(container) for container in reached))
    poses = [Pose(x_m=x, y_m=y, yaw_rad=yaw) for x, y, yaw in kept["standing"].tolist()]
    origin = (float(kept["origin"][0]), float(kept["origin"][1]))
    free = bits("free")
    free.flags.writeable = False
    return Navigation(
        travel=TravelCosts(
            locations=locations,
            metres=kept["metres"],
            unreachable=tuple(c.id for c in plan.containers if c.id not in set(reached)),
        ),
        grid=OccupancyGrid(origin=origin, resolution_m=resolution_m, occupied=bits("occupied")),
        free=free,
        standing=dict(zip(locations, poses, strict=True)),
    )
