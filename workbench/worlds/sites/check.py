"""Checks of a survey file: findings with their fixes, errors first (a robot cannot run), then warnings (results
suffer)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import hypot
from typing import Literal

from workbench.worlds.geometry import Pose, footprint
from workbench.worlds.house import START, Container, LocationId, Room
from workbench.worlds.names import is_container, vocabulary
from workbench.worlds.sites.paths import SiteNavigation
from workbench.worlds.sites.ros_map import read_survey_map
from workbench.worlds.sites.site import Site

SMALL_TAG_M = 0.07
"""Side in metres below which Spot's own detector, which sees a tag of 0.146 m from 3 m, needs to be close."""
SHARED_FLOOR = 0.1
"""Share of the smaller floor that two rooms have in common at most: walls are thick, and corners measured by hand."""
Level = Literal["error", "warning", "note"]
ORDER: tuple[Level, ...] = ("error", "warning", "note")


@dataclass(frozen=True, slots=True, kw_only=True)
class SiteFinding:
    """A problem in a survey.

    Attributes:
        where: the part of the survey concerned.
        what: what is wrong with it.
        fix: how to fix it.
    """

    level: Level
    where: str
    what: str
    fix: str


def check_site(site: Site) -> tuple[SiteFinding, ...]:
    """All findings of a survey, errors first."""
    found = [*_reach(site), *_rooms(site), *_containers(site), *_map(site), *_robot_side(site), *_tags(site)]
    return tuple(sorted(found, key=lambda finding: ORDER.index(finding.level)))


def _reach(site: Site) -> Iterator[SiteFinding]:
    if not site.plan.containers:
        yield _error("containers", "there is none", "Survey at least one container")
    if not site.travel.reaches(START):
        what = "lies off the map" if _off_the_map(site) else "lies on no free ground of the map"
        yield _error("start", what, "Move the start pose, or correct the map")
        return
    for name in site.travel.unreachable:
        yield _error(f"container {name}", "cannot be reached from the start", "Correct its pose, or give stand:")


def _off_the_map(site: Site) -> bool:
    if site.grid is None:
        return False
    row, column = site.grid.cell_at(site.plan.start.point)
    rows, columns = site.grid.occupied.shape
    return not (0 <= row < rows and 0 <= column < columns)


def _rooms(site: Site) -> Iterator[SiteFinding]:
    for room in site.plan.rooms:
        if room.kind == "Unknown":
            yield SiteFinding(
                level="warning",
                where=f"room {room.id}",
                what="its kind is Unknown, so the belief knows nothing of it",
                fix="Say what it is: Kitchen, LivingRoom, Bedroom, Bathroom, or in words of your own",
            )
    for a, b in _overlapping_rooms(site.plan.rooms):
        yield SiteFinding(
            level="warning", where=f"rooms {a} and {b}", what="overlap", fix="Correct the corners of their floors"
        )


def _containers(site: Site) -> Iterator[SiteFinding]:
    for container in site.plan.containers:
        where = f"container {container.id}"
        if not is_container(container.type):
            kind = "is no container type of the vocabulary" if container.type in vocabulary() else "is unknown"
            yield SiteFinding(
                level="warning",
                where=where,
                what=f"type {container.type} {kind}, so the belief knows it by its name only",
                fix="Use the nearest container type, for instance Sofa for a couch",
            )
        if not _inside(site, container.pose, container):
            yield SiteFinding(
                level="warning", where=where, what=f"lies outside room {container.room}", fix="Correct pose or room"
            )
    for a, b in _overlapping(site.plan.containers):
        yield SiteFinding(
            level="warning", where=f"containers {a} and {b}", what="overlap", fix="Correct their poses or sizes"
        )


def _map(site: Site) -> Iterator[SiteFinding]:
    if site.grid is None:
        yield SiteFinding(
            level="warning",
            where="map",
            what="there is none; paths are drawn as straight lines and other starts cannot be used",
            fix="Add map: with the YAML of map_saver",
        )
    surveyed = None if site.file.map is None else read_survey_map(site.path.parent / site.file.map)
    if surveyed is not None and surveyed.read_otherwise:
        yield SiteFinding(
            level="warning",
            where="map",
            what=f"{surveyed.read_otherwise} cells are free by one release of map_server and not by another "
            "(equal to a threshold, transparent, or coloured)",
            fix="Save the map as plain grey, and choose thresholds that no grey of it equals",
        )
    grey = 0 if surveyed is None else surveyed.grey_read_as_free
    if grey:
        yield SiteFinding(
            level="warning",
            where="map",
            what=f"{grey} cells have the grey of unsurveyed ground (205), but its free_thresh reads them as free",
            fix="Write free_thresh: 0.196 in the map's YAML file, so that they are unknown",
        )
    if site.travel_source == "measured":
        symmetric = abs(site.travel.metres - site.travel.metres.T).max()
        if symmetric > 0.5:
            yield SiteFinding(
                level="note",
                where="travel",
                what=f"there and back differ by up to {symmetric:.1f} m",
                fix="Measure again if that is not meant",
            )
    if not site.plan.walls:
        yield SiteFinding(level="note", where="walls", what="none are given", fix="Add walls: for a fuller picture")
    if isinstance(site.navigation, SiteNavigation):
        for name, pose in site.navigation.standing.items():
            row, column = site.navigation.grid.cell_at(pose.point)
            rows, columns = site.navigation.free.shape
            if not (0 <= row < rows and 0 <= column < columns and site.navigation.free[row, column]):
                yield SiteFinding(
                    level="warning",
                    where=f"stand of {name}",
                    what=f"is closer than {site.robot.radius_m:g} m to something on the map",
                    fix="Move it, or lower robot: radius_m",
                )


def _robot_side(site: Site) -> Iterator[SiteFinding]:
    without = [c.id for c in site.plan.containers if LocationId(c.id) not in site.waypoints]
    if without:
        yield SiteFinding(
            level="note",
            where="waypoints",
            what=f"{len(without)} containers have none ({', '.join(without[:4])}); the robot goes to their map pose",
            fix="Record a GraphNav waypoint at each, or align the map with the robot's seed frame",
        )
    doubled = [w for w in site.waypoints.values() if list(site.waypoints.values()).count(w) > 1]
    if doubled:
        yield _error("waypoints", f"{sorted(set(doubled))[0]} stands for two locations", "Give each its own")


def _tags(site: Site) -> Iterator[SiteFinding]:
    if not site.tags:
        yield SiteFinding(
            level="warning",
            where="tags",
            what="no item has a tag, so a robot recognises nothing",
            fix="Add tags: with the fiducial's number, the item and its type",
        )
    small = [n for n, tag in site.file.tags.items() if tag.size_m < SMALL_TAG_M]
    if small and site.file.detector.kind == "robot":
        yield SiteFinding(
            level="warning",
            where="tags",
            what=f"{len(small)} are too small for Spot's own detector beyond 1.4 m (first: {small[0]})",
            fix="Add detector: {kind: opencv}, and give tags their size_m",
        )
    for number, item in site.tags.items():
        word = vocabulary().get(item.type)
        if word is None or not word.carry:
            yield SiteFinding(
                level="note",
                where=f"tag {number}",
                what=f"{item.type} is no item type of the vocabulary, so the belief knows it by its name only",
                fix="Use the nearest type, for instance CellPhone",
            )


def _error(where: str, what: str, fix: str) -> SiteFinding:
    return SiteFinding(level="error", where=where, what=what, fix=fix)


def _inside(site: Site, pose: Pose, container: Container) -> bool:
    from shapely import Point as ShapelyPoint
    from shapely import Polygon

    return Polygon(site.plan.room(container.room).floor).buffer(0.3).contains(ShapelyPoint(pose.x_m, pose.y_m))


def _overlapping_rooms(rooms: tuple[Room, ...]) -> Iterator[tuple[str, str]]:
    from shapely import Polygon

    floors = [(room.id, Polygon(room.floor).buffer(0)) for room in rooms]
    for (a, one), (b, other) in combinations(floors, 2):
        if one.intersection(other).area > SHARED_FLOOR * min(one.area, other.area):
            yield a, b


def _overlapping(containers: tuple[Container, ...]) -> Iterator[tuple[str, str]]:
    from shapely import Polygon

    boxes = [(c, Polygon(footprint(c.pose, c.size_m[0], c.size_m[1]))) for c in containers]
    for i, (a, box_a) in enumerate(boxes):
        for b, box_b in boxes[i + 1 :]:
            near = hypot(a.pose.x_m - b.pose.x_m, a.pose.y_m - b.pose.y_m) < 10
            if near and box_a.intersection(box_b).area > 0.5 * min(box_a.area, box_b.area):
                yield a.id, b.id
