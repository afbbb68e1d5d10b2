"""The fields of a survey file, validated on reading, with the position of the first error.

Lengths are in metres and headings in degrees, as a surveyor writes them; the code uses radians.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import msgspec

from workbench.errors import MalformedFile
from workbench.worlds.geometry import MAX_COORDINATE_M
from workbench.worlds.house_yaml import is_house
from workbench.worlds.sites.ros_map import MAX_YAML_BYTES, read_yaml

SITE_VERSION = 1
ROBOT_TAG_M = 0.146
"""The side of a fiducial in metres that Spot's own detector expects (Spot SDK, "Fiducials")."""

Metres = Annotated[float, msgspec.Meta(gt=0.0, le=100.0)]
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=120)]
Chance = Annotated[float, msgspec.Meta(gt=0.0, le=1.0)]
Coordinate = Annotated[float, msgspec.Meta(ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M)]
Corner = tuple[Coordinate, Coordinate]


class PoseEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    x_m: Coordinate
    y_m: Coordinate
    yaw_deg: Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)] = 0.0


class RoomEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    id: Name
    kind: Name
    floor: Annotated[tuple[Corner, ...], msgspec.Meta(min_length=3)]


class WallEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    start: Corner
    end: Corner
    height_m: Metres = 2.5
    room: str | None = None


class DoorEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    start: Corner
    end: Corner
    rooms: tuple[str, ...] = ()
    passable: bool = True


class ContainerEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """stand is where the robot stands to use it; waypoint names that place for GraphNav or move_base.

    closed: its contents are visible only from where the robot stands to open it (a fridge, a garbage can).
    """

    id: Name
    type: Name
    room: Name
    pose: PoseEntry
    size_m: tuple[Metres, Metres, Metres]
    base_m: Annotated[float, msgspec.Meta(ge=0.0, le=10.0)] = 0.0
    stand: PoseEntry | None = None
    waypoint: str = ""
    closed: bool = False


class TagEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """size_m is the side of the tag's black square, without the white around it."""

    item: Name
    type: Name
    size_m: Annotated[float, msgspec.Meta(gt=0.0, le=2.0)] = ROBOT_TAG_M


class DetectorEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What finds the tags of items: the robot's own detector, or OpenCV's in pictures of these image sources; and the
    chance that one look detects an item that is there, by item type where it is not the same for all."""

    kind: Literal["robot", "opencv"] = "robot"
    cameras: Annotated[tuple[Name, ...], msgspec.Meta(min_length=1, max_length=12)] = (
        "hand_color_image",
        "frontleft_fisheye_image",
        "frontright_fisheye_image",
    )
    family: Literal["36h11", "36h10", "25h9", "16h5", "alvar"] = "36h11"
    p_detect: Chance = 1.0
    p_detect_of: dict[Name, Chance] = {}


class RobotEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    name: Name = "spot"
    arm: bool = True
    radius_m: Annotated[float, msgspec.Meta(ge=0.0, le=2.0)] = 0.3
    speed_mps: Annotated[float, msgspec.Meta(gt=0.0, le=1.6)] = 0.5
    dock: Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)] | None = None


class FrameEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    map: Name = "map"
    odom: Name = "odom"
    body: Name = "base_link"


class TravelEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Measured path lengths: a CSV whose first row and column name the locations, or the matrix itself."""

    file: str | None = None
    locations: tuple[str, ...] = ()
    metres: tuple[tuple[float, ...], ...] = ()
    source: str = ""


class SiteFile(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    lios_site: int
    name: Name
    start: PoseEntry
    rooms: Annotated[tuple[RoomEntry, ...], msgspec.Meta(min_length=1)]
    containers: tuple[ContainerEntry, ...]
    map: str | None = None
    walls: tuple[WallEntry, ...] = ()
    doors: tuple[DoorEntry, ...] = ()
    tags: dict[int, TagEntry] = {}
    detector: DetectorEntry = DetectorEntry()
    robot: RobotEntry = RobotEntry()
    frames: FrameEntry = FrameEntry()
    travel: TravelEntry | None = None
    seed: PoseEntry = PoseEntry(x_m=0.0, y_m=0.0)
    start_waypoint: str = ""


class NoTravelCosts(MalformedFile):
    """A survey without a source of travel costs."""

    def __init__(self, path: Path) -> None:
        super().__init__(
            path,
            "it names neither a map nor measured travel costs",
            "Add map: map.yaml, or travel: {file: travel.csv}",
        )


def read_site_file(path: Path) -> SiteFile:
    """The survey, checked.

    Raises:
        FileMissing: no such file.
        MalformedFile: not a survey, or of another version.
    """
    if path.is_file() and path.stat().st_size <= MAX_YAML_BYTES and is_house(path.read_bytes()):
        raise MalformedFile(path, "a house, and not a survey", "lios record --house takes it")
    file = read_yaml(path, SiteFile)
    if file.lios_site != SITE_VERSION:
        fix = "Upgrade lios-workbench" if file.lios_site > SITE_VERSION else f"Write lios_site: {SITE_VERSION}"
        raise MalformedFile(path, f"version {file.lios_site}; this release reads {SITE_VERSION}", fix)
    rooms = {room.id for room in file.rooms}
    for container in file.containers:
        if container.room not in rooms:
            known = ", ".join(sorted(rooms))
            raise MalformedFile(
                path, f"container {container.id} is in room {container.room!r}, which is not there", f"Rooms: {known}"
            )
    ids = [container.id for container in file.containers]
    twice = sorted({name for name in ids if ids.count(name) > 1} | ({"start"} & set(ids)))
    if twice:
        raise MalformedFile(path, f"container ids {', '.join(twice)} are taken twice", "Give each its own id")
    items = [tag.item for tag in file.tags.values()]
    if len(set(items)) != len(items):
        raise MalformedFile(path, "two tags name the same item", "Give each tag its own item")
    both = sorted(set(items) & {*ids, "start"})
    if both:
        fix = "Give the item another id, for instance WaterBottle|1"
        raise MalformedFile(path, f"{', '.join(both)} is the id of a location and of an item", fix)
    return file
