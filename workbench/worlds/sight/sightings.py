"""Paths of a robot that sees open furniture in passing: what comes into view where, and where it stops.

Shared by the simulated world and by replay, which must agree: both work it out from the floor plan and the paths.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import atan2, ceil, hypot, isfinite
from typing import Protocol, final

import numpy as np

from workbench.arrays import Floats
from workbench.tolerances import ROUNDING
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import START, ContainerId, FloorPlan, Item, ItemType, LocationId
from workbench.worlds.sight.lines_of_sight import LinesOfSight, checked_radius
from workbench.worlds.travel import Paths, TravelCosts

STEP_M = 0.1
"""Distance in metres between the points of a path from which the robot looks: the cells of the occupancy grid."""

ON_THE_WAY = "on the way"
"""What the id of a location begins with that is no container, but a point at which the robot stopped."""


def stop_point(location: str) -> Point | None:
    """Where the robot stopped on its way, in metres, by the id of the location; None for any other location."""
    kind, *numbers = location.split("|")
    if kind != ON_THE_WAY or len(numbers) != 2:
        return None
    try:
        x_m, y_m = float(numbers[0]), float(numbers[1])
    except ValueError:
        return None
    return (x_m, y_m) if isfinite(x_m) and isfinite(y_m) else None


class PathsFromPoints(Paths, Protocol):
    """Paths between locations, and from any point of one."""

    def path_from(self, point: Point, location: LocationId) -> tuple[Point, ...] | None:
        """Corner points from a point of a path to a location, both ends included; None if there is no path."""
        ...

    def metres_from(self, point: Point) -> Floats:
        """Travel costs in metres from a point of a path to every reachable location, in the order of the costs."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """A container comes into view.

    Attributes:
        viewpoint: where the robot is, facing along its path.
        along_m: metres walked on this path before.
    """

    container: ContainerId
    viewpoint: Pose
    along_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Walk:
    """A walk as far as it went.

    Attributes:
        end: where it ended: its goal, or the point at which the robot stopped.
        metres: its length.
        path: its corner points.
        seen: the containers that came into view for the first time, with their contents.
    """

    end: LocationId
    metres: float
    path: tuple[Point, ...]
    seen: tuple[tuple[Sighting, tuple[Item, ...]], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class UnknownSight:
    """A container comes into view, and its contents are unknown."""

    container: ContainerId


@final
class SightPaths:
    """The paths of one place with what comes into view on each; every path is worked out once. Implements Paths.

    Containers that the robot cannot stand at are left out: it could fetch nothing from them.

    Args:
        travel: travel costs between all locations.
        radius_m: how far the robot sees, in metres.
        containers: those that can be seen in passing; None for open furniture.

    Raises:
        BadValue: no sight radius.
    """

    def __init__(
        self,
        plan: FloorPlan,
        travel: TravelCosts,
        paths: PathsFromPoints,
        radius_m: float,
        *,
        containers: Collection[ContainerId] | None = None,
    ) -> None:
        self.radius_m = radius_m
        self._lines = LinesOfSight(plan, radius_m)
        visible = self._lines.open if containers is None else [c for c in plan.containers if c.id in containers]
        self._open = tuple(c for c in visible if travel.reaches(LocationId(c.id)))
        self._travel = replace(travel, sight=self)
        self._base = paths
        self._travels: dict[LocationId, TravelCosts] = {}
        self._paths: dict[tuple[LocationId, LocationId], tuple[Point, ...] | None] = {}
        self._along: dict[tuple[LocationId, LocationId], tuple[Sighting, ...]] = {}

    @property
    def open(self) -> tuple[ContainerId, ...]:
        """The containers that can be seen in passing, in the plan's order."""
        return tuple(c.id for c in self._open)

    def standing_pose(self, location: LocationId) -> Pose | None:
        return self._stop(location) or self._base.standing_pose(location)

    def path(self, a: LocationId, b: LocationId) -> tuple[Point, ...] | None:
        if (a, b) not in self._paths:
            stop = self._stop(a)
            self._paths[a, b] = self._base.path(a, b) if stop is None else self._base.path_from(stop.point, b)
        return self._paths[a, b]

    def travel_from(self, location: LocationId) -> TravelCosts:
        """The travel costs, with those from a location that is a point on a path."""
        stop = self._stop(location)
        if stop is None:
            return self._travel
        if location not in self._travels:
            self._travels[location] = with_point(self._travel, location, self._base.metres_from(stop.point))
        return self._travels[location]

    def at_start(self) -> tuple[Sighting, ...]:
        """What the robot sees from its start pose."""
        pose = self._base.standing_pose(START)
        if pose is None:
            return ()
        seen = (c for c in self._open if self._lines.sees(c, pose.point))
        return tuple(Sighting(container=c.id, viewpoint=pose, along_m=0.0) for c in seen)

    def along(self, a: LocationId, b: LocationId) -> tuple[Sighting, ...]:
        """What comes into view on the way from a to b, both ends included, in order."""
        if (a, b) not in self._along:
            self._along[a, b] = self._found_along(self.path(a, b) or (), self.standing_pose(b))
        return self._along[a, b]

    def coming_into_view(self, a: LocationId, b: LocationId) -> tuple[tuple[ContainerId, float, float], ...]:
        """What comes into view on the way from a to b, in order, with the metres of the way before that, and those
        straight on to where the robot stands at the container (Sight)."""
        seen: list[tuple[ContainerId, float, float]] = []
        for s in self.along(a, b):
            there = self._base.standing_pose(LocationId(s.container)) or s.viewpoint
            on_m = hypot(there.x_m - s.viewpoint.x_m, there.y_m - s.viewpoint.y_m)
            seen.append((s.container, s.along_m, on_m))
        return tuple(seen)

    def metres_from_view(self, a: LocationId, b: LocationId) -> Floats | None:
        """Metres from where b comes into view on the way from a to every location; None for nowhere (Sight)."""
        view = next((s for s in self.along(a, b) if s.container == b), None)
        return None if view is None else self.travel_from(stop_at(view.viewpoint)).metres[-1, :-1]

    def walk(
        self,
        a: LocationId,
        b: LocationId,
        *,
        seeking: Collection[ItemType] | None,
        known: Collection[ContainerId],
        shows: Callable[[ContainerId], tuple[Item, ...] | None],
    ) -> Walk | UnknownSight | None:
        """Walk from a towards b; None if there is no way.

        A robot that goes to look into b stops where b comes into view, or an item that it seeks does.

        Args:
            seeking: the item types sought by a robot that goes to look into b; None for one that goes there for
                another reason, which does not stop.
            known: containers that are known already, or never to be.
            shows: the contents of a container that comes into view; None where they are unknown.
        """
        metres, path = self.travel_from(a).between(a, b), self.path(a, b)
        if metres is None or path is None:
            return None
        seen: list[tuple[Sighting, tuple[Item, ...]]] = []
        stop: Sighting | None = None
        for sighting in self.along(a, b):
            if stop is not None and sighting.along_m > stop.along_m + ROUNDING:
                break
            if sighting.container in known:
                continue
            items = shows(sighting.container)
            if items is None:
                return UnknownSight(container=sighting.container)
            seen.append((sighting, items))
            wanted = seeking is not None and (sighting.container == b or any(item.type in seeking for item in items))
            if stop is None and wanted and sighting.along_m < metres - ROUNDING:
                stop = sighting
        if stop is None:
            return Walk(end=b, metres=metres, path=path, seen=tuple(seen))
        return Walk(
            end=stop_at(stop.viewpoint),
            metres=stop.along_m,
            path=_up_to(path, stop.along_m, stop.viewpoint.point),
            seen=tuple(seen),
        )

    def _stop(self, location: LocationId) -> Pose | None:
        """The pose of a stop, by its name alone, so that it is the same in whatever order paths are walked; None for
        any other location.
        """
        point = stop_point(location)
        return None if point is None else Pose(x_m=point[0], y_m=point[1])

    def _found_along(self, path: Sequence[Point], end: Pose | None) -> tuple[Sighting, ...]:
        left = list(self._open)
        seen: list[Sighting] = []
        for pose, along_m in poses_along(path, end):
            now = [c for c in left if self._lines.sees(c, pose.point)]
            seen += [Sighting(container=c.id, viewpoint=pose, along_m=along_m) for c in now]
            left = [c for c in left if c not in now]
        return tuple(seen)


def stop_at(pose: Pose) -> LocationId:
    """The location of a stop, named by its coordinates to the millimetre."""
    return LocationId(f"{ON_THE_WAY}|{pose.x_m:.3f}|{pose.y_m:.3f}")


def sight_paths(plan: FloorPlan, travel: TravelCosts, paths: PathsFromPoints, radius_m: float) -> SightPaths | None:
    """The ways of a robot with a sight radius; None for one that sees nothing in passing (0).

    Raises:
        BadValue: no sight radius.
    """
    return SightPaths(plan, travel, paths, radius_m) if checked_radius(radius_m) else None


def with_point(travel: TravelCosts, location: LocationId, row: Floats) -> TravelCosts:
    """Travel costs with one more location, the last."""
    n = len(travel.locations)
    metres = np.zeros((n + 1, n + 1))
    metres[:n, :n] = travel.metres
    metres[n, :n] = metres[:n, n] = row
    return TravelCosts(
        locations=(*travel.locations, location),
        metres=metres,
        unreachable=travel.unreachable,
        sight=travel.sight,
    )


def poses_along(path: Sequence[Point], end: Pose | None) -> Iterator[tuple[Pose, float]]:
    """Poses along a path, a cell apart and the corners among them, each with the metres before it."""
    walked = 0.0
    for a, b in pairwise(path):
        yaw, length = atan2(b[1] - a[1], b[0] - a[0]), hypot(b[0] - a[0], b[1] - a[1])
        steps = max(1, ceil((max(abs(b[0] - a[0]), abs(b[1] - a[1])) - ROUNDING) / STEP_M))
        for step in range(steps):
            share = step / steps
            at = (a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share)
            yield Pose(x_m=at[0], y_m=at[1], yaw_rad=yaw), walked + length * share
        walked += length
    if path:
        yaw = 0.0 if end is None else end.yaw_rad
        yield Pose(x_m=path[-1][0], y_m=path[-1][1], yaw_rad=yaw), walked


def _up_to(path: Sequence[Point], along_m: float, point: Point) -> tuple[Point, ...]:
    """The corners of a path before a point of it, and the point."""
    kept, walked = [path[0]], 0.0
    for a, b in pairwise(path):
        walked += hypot(b[0] - a[0], b[1] - a[1])
        if walked >= along_m - ROUNDING:
            break
        kept.append(b)
    return (*kept, point)
