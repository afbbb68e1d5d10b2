"""Paths of a robot that sees the tags of items as it passes: which containers it has in view where, and its stops.

Whether it sees a tag that is in view depends on light, angle and luck. So nothing follows from this but where an item
may be seen, and where the robot then turns: it counts no tag elsewhere, and a replay allows for all of them.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from math import hypot, inf
from typing import final

from workbench.tolerances import ROUNDING
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import ContainerId, FloorPlan, LocationId
from workbench.worlds.sight.sightings import (
    PathsFromPoints,
    Sighting,
    SightPaths,
    poses_along,
    stop_at,
    stop_point,
    with_point,
)
from workbench.worlds.travel import TravelCosts

NEAR_M, EVERY_M = 0.5, 1.0
"""A robot that is nearer than NEAR_M to where it is going does not turn before it; elsewhere it turns at one of
several points, EVERY_M apart."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TurningPoint:
    """A point of a path at which a robot turns for what it has seen.

    Attributes:
        along_m: metres of the path before it, as it is drawn; walked_m: what they cost, by the travel costs.
    """

    location: LocationId
    along_m: float
    walked_m: float


@final
class TagsInPassing:
    """The paths of one place, with the containers whose items' tags may be seen on each. Implements Paths.

    Args:
        travel: travel costs between all locations.
        radius_m: how far from a container a tag in it counts, in metres.
        containers: those in which a tag may be seen in passing: closed furniture is not among them.

    Raises:
        BadValue: no sight radius.
    """

    def __init__(
        self,
        plan: FloorPlan,
        travel: TravelCosts,
        paths: PathsFromPoints,
        radius_m: float,
        containers: Collection[ContainerId],
    ) -> None:
        self.radius_m = radius_m
        self.containers = tuple(c.id for c in plan.containers if c.id in containers)
        self._travel = travel
        self._metres_from = paths.metres_from
        self._passing = SightPaths(plan, travel, paths, radius_m, containers=self.containers)
        self._travels: dict[LocationId, TravelCosts] = {}
        self._turning: dict[tuple[LocationId, LocationId, ContainerId], tuple[TurningPoint, ...]] = {}

    def standing_pose(self, location: LocationId) -> Pose | None:
        return self._passing.standing_pose(location)

    def path(self, a: LocationId, b: LocationId) -> tuple[Point, ...] | None:
        return self._passing.path(a, b)

    def travel_from(self, location: LocationId) -> TravelCosts:
        """The travel costs, with those from a location that is a point on a path."""
        point = stop_point(location)
        if point is None:
            return self._travel
        if location not in self._travels:
            self._travels[location] = with_point(self._travel, location, self._metres_from(point))
        return self._travels[location]

    def in_view(self, a: LocationId, b: LocationId) -> tuple[Sighting, ...]:
        """The containers that come into view on the way from a to b, and where; b itself, which the robot goes to
        look into, is left out."""
        return tuple(s for s in self._passing.along(a, b) if s.container != b)

    def turning_points(self, a: LocationId, b: LocationId, container: ContainerId) -> tuple[TurningPoint, ...]:
        """Where a robot that sees a tag in a container on its way from a to b turns for it, in order.

        The first is the point of the path, once the container is in view, nearest to where the robot stands at it;
        the others come every EVERY_M after that. The robot turns at the next of them, so that a replay knows
        every place at which it may turn; after the last of them it goes on and looks into b, as it was about to.
        """
        key = (a, b, container)
        if key not in self._turning:
            view = next((s for s in self.in_view(a, b) if s.container == container), None)
            self._turning[key] = () if view is None else self._found_turning(a, b, view)
        return self._turning[key]

    def along(self, a: LocationId, b: LocationId, point: Point) -> tuple[float, float]:
        """Metres from a of the point of the path to b that is nearest to a point, and how far it is from there."""
        near = ((hypot(pose.x_m - point[0], pose.y_m - point[1]), m) for pose, m in self._poses(a, b))
        away_m, along_m = min(near, default=(inf, 0.0))
        return along_m, away_m

    def _found_turning(self, a: LocationId, b: LocationId, view: Sighting) -> tuple[TurningPoint, ...]:
        poses, stand = self._poses(a, b), self.standing_pose(LocationId(view.container)) or view.viewpoint
        whole_m = poses[-1][1]
        left = [(pose, m) for pose, m in poses if view.along_m - ROUNDING <= m < whole_m - NEAR_M]
        found: list[TurningPoint] = []
        if left:
            _, due_m = min(left, key=lambda p: (hypot(p[0].x_m - stand.x_m, p[0].y_m - stand.y_m), p[1]))
            for pose, along_m in left:
                if along_m >= due_m - ROUNDING:
                    stop = stop_at(pose)
                    walked_m = self.travel_from(stop).between(stop, a)
                    found.append(
                        TurningPoint(
                            location=stop, along_m=along_m, walked_m=along_m if walked_m is None else walked_m
                        )
                    )
                    due_m = along_m + EVERY_M
        return tuple(found)

    def _poses(self, a: LocationId, b: LocationId) -> list[tuple[Pose, float]]:
        return list(poses_along(self.path(a, b) or (), self.standing_pose(b)))
