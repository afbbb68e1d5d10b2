"""Real sites from a survey file in YAML: rooms, containers, map, waypoints, tags, robot and frames.

A site is a floor plan with unknown contents, and with travel costs from its occupancy map (ROS map_server) or
measured between waypoints (a matrix of path lengths, from move_base's make_plan or GraphNav). docs/spot.md
describes the file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.resources import files
from math import radians
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from workbench.errors import InputError, UnknownName
from workbench.worlds.geometry import Pose
from workbench.worlds.house import (
    Container,
    ContainerId,
    FloorPlan,
    Item,
    ItemId,
    ItemType,
    LocationId,
    Opening,
    Room,
    RoomId,
    Wall,
)
from workbench.worlds.maps.occupancy import OccupancyGrid
from workbench.worlds.perception import Perception
from workbench.worlds.sites.measured_lengths import MeasuredNavigation, measured_travel
from workbench.worlds.sites.paths import SiteNavigation, find_paths
from workbench.worlds.sites.ros_map import read_map
from workbench.worlds.sites.survey_schema import PoseEntry, RoomEntry, SiteFile, TravelEntry, read_site_file
from workbench.worlds.travel import Paths, TravelCosts

TravelSource = Literal["map", "measured"]
UNSURVEYED = "unsurveyed"
"""Name of the site of a place without a survey."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotProfile:
    """The robot's shape, speed and dock (its number; None for none) by the survey file."""

    name: str = "spot"
    arm: bool = True
    radius_m: float = 0.3
    speed_mps: float = 0.5
    dock: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """A real place, its contents unknown.

    Attributes:
        path: the survey file.
        plan: rooms, walls, containers and the start pose.
        grid: the occupancy map; None if the file names none.
        navigation: standing poses, paths and travel costs.
        waypoints: per location, the GraphNav waypoint (id or name) or move_base goal; may be empty.
        tags: per AprilTag or ar_track_alvar id, the item that carries it.
        robot: its shape and speed.
        frames: the names of the map, odometry and body frames.
        seed: GraphNav's seed frame on the map.
        file: the survey file as read.
    """

    path: Path
    plan: FloorPlan
    navigation: SiteNavigation | MeasuredNavigation
    grid: OccupancyGrid | None = None
    waypoints: Mapping[LocationId, str] = field(default_factory=lambda: MappingProxyType({}))
    tags: Mapping[int, Item] = field(default_factory=lambda: MappingProxyType({}))
    robot: RobotProfile = field(default_factory=RobotProfile)
    frames: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    seed: Pose = field(default_factory=lambda: Pose(x_m=0.0, y_m=0.0))
    file: SiteFile

    @property
    def name(self) -> str:
        return self.plan.name

    @property
    def travel(self) -> TravelCosts:
        return self.navigation.travel

    @property
    def paths(self) -> Paths:
        return self.navigation

    @property
    def travel_source(self) -> TravelSource:
        return "map" if isinstance(self.navigation, SiteNavigation) else "measured"

    @property
    def perception(self) -> Perception:
        """How surely a look detects what is there, as the file says; everything where it says nothing."""
        detector = self.file.detector
        by_type = {ItemType(name): p for name, p in detector.p_detect_of.items()}
        return Perception(p_detect=detector.p_detect, by_type=by_type, source="site", detector=detector.kind)


def load_site(path: Path | str) -> Site:
    """The site of a survey file, or of a shipped site by its name ("paper_home").

    Raises:
        FileMissing: there is no such file, or its map is missing.
        MalformedFile: the file is not a survey; says where.
        UnknownName: a short name that is not a shipped site.
    """
    found = _find(path)
    return _site(found, read_site_file(found))


def _site(found: Path, file: SiteFile) -> Site:
    plan = _plan(file)
    grid = read_map(found.parent / file.map) if file.map is not None else None
    return Site(
        path=found,
        plan=plan,
        navigation=_navigation(found, file, plan, grid),
        grid=grid,
        waypoints=MappingProxyType(
            {LocationId(c.id): c.waypoint for c in file.containers if c.waypoint}
            | ({LocationId("start"): file.start_waypoint} if file.start_waypoint else {})
        ),
        tags=MappingProxyType(
            {number: Item(id=ItemId(t.item), type=ItemType(t.type)) for number, t in sorted(file.tags.items())}
        ),
        robot=RobotProfile(
            name=file.robot.name,
            arm=file.robot.arm,
            radius_m=file.robot.radius_m,
            speed_mps=file.robot.speed_mps,
            dock=file.robot.dock,
        ),
        frames=MappingProxyType({"map": file.frames.map, "odom": file.frames.odom, "body": file.frames.body}),
        seed=pose_of(file.seed),
        file=file,
    )


def starting_at(site: Site, start: Pose) -> Site:
    """The site with another start pose; the travel costs from the start are computed again.

    Raises:
        CannotStartThere: the site has only measured travel costs.
    """
    if start == site.plan.start:
        return site
    if site.grid is None or not isinstance(site.navigation, SiteNavigation):
        raise CannotStartThere(site)
    plan = replace(site.plan, start=start)
    stand = {place: pose for place, pose in site.navigation.standing.items() if place != "start"}
    return replace(
        site, plan=plan, navigation=find_paths(plan, site.grid, robot_radius_m=site.robot.radius_m, stand=stand)
    )


def unsurveyed_site() -> Site:
    """A site of one large room without containers, for recording an unsurveyed place."""
    wide = 50.0
    file = SiteFile(
        lios_site=1,
        name=UNSURVEYED,
        start=PoseEntry(x_m=0.0, y_m=0.0),
        rooms=(
            RoomEntry(id="room", kind="Unknown", floor=((-wide, -wide), (wide, -wide), (wide, wide), (-wide, wide))),
        ),
        containers=(),
        travel=TravelEntry(locations=("start",), metres=((0.0,),)),
    )
    return _site(Path(UNSURVEYED), file)


def shipped_sites() -> dict[str, Path]:
    """The sites that come with this package, by name."""
    folder = Path(str(files("workbench") / "data" / "sites"))
    return {path.parent.name: path for path in sorted(folder.glob("*/site.yaml"))}


class CannotStartThere(InputError):
    """Another start pose was requested for a site with only measured travel costs."""

    def __init__(self, site: Site) -> None:
        super().__init__(
            f"{site.path}: travel costs are measured from one start pose, so another start cannot be used. "
            "Name a map in the site file, or measure again."
        )


def _find(path: Path | str) -> Path:
    given = Path(path)
    if given.is_dir():
        return given / "site.yaml"
    if not given.exists() and given.suffix == "" and len(given.parts) == 1:
        known = shipped_sites()
        if given.name not in known:
            raise UnknownName("site", given.name, known)
        return known[given.name]
    return given


def _plan(file: SiteFile) -> FloorPlan:
    containers = tuple(
        Container(
            id=ContainerId(c.id),
            type=c.type,
            room=RoomId(c.room),
            pose=pose_of(c.pose),
            size_m=c.size_m,
            base_m=c.base_m,
        )
        for c in file.containers
    )
    return FloorPlan(
        name=file.name,
        rooms=tuple(Room(id=RoomId(r.id), kind=r.kind, floor=r.floor) for r in file.rooms),
        walls=tuple(
            Wall(
                id=f"wall|{number}",
                start=w.start,
                end=w.end,
                height_m=w.height_m,
                room=None if w.room is None else RoomId(w.room),
            )
            for number, w in enumerate(file.walls, start=1)
        ),
        doors=tuple(
            Opening(
                id=f"door|{number}",
                start=d.start,
                end=d.end,
                rooms=tuple(RoomId(r) for r in d.rooms),
                passable=d.passable,
            )
            for number, d in enumerate(file.doors, start=1)
        ),
        windows=(),
        containers=containers,
        furniture=(),
        start=pose_of(file.start),
    )


def _navigation(
    path: Path, file: SiteFile, plan: FloorPlan, grid: OccupancyGrid | None
) -> SiteNavigation | MeasuredNavigation:
    stand = {LocationId(c.id): pose_of(c.stand) for c in file.containers if c.stand is not None}
    if file.travel is not None:
        return measured_travel(path, file.travel, plan, stand)
    if grid is None:
        from workbench.worlds.sites.survey_schema import NoTravelCosts

        raise NoTravelCosts(path)
    return find_paths(plan, grid, robot_radius_m=file.robot.radius_m, stand=stand)


def pose_of(entry: PoseEntry) -> Pose:
    """A pose entry of the file, its heading in radians."""
    return Pose(x_m=entry.x_m, y_m=entry.y_m, yaw_rad=radians(entry.yaw_deg))
