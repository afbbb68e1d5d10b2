"""Houses written by hand in YAML: rooms as rectangles, doors as points on shared walls, containers as boxes.

Lengths are in metres on the map. docs/worlds.md describes the file; `lios new house` writes one.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from math import isfinite
from pathlib import Path
from typing import Annotated

import msgspec

from workbench.errors import FileMissing, MalformedFile
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import (
    Container,
    ContainerId,
    FloorPlan,
    House,
    Item,
    ItemId,
    ItemType,
    Opening,
    Room,
    RoomId,
    Wall,
)
from workbench.worlds.maps.connectivity import require_connected

SUFFIXES = (".yaml", ".yml")
VERSION = 1
MAX_BYTES = 1_000_000
DOOR_M = 0.9
NEAR_M = 0.01
"""Walls closer than this are one wall."""
COMPARE = "Compare it with what lios new house writes"

Box = tuple[float, float, float, float]
"""x and y of two opposite corners, in metres."""
Name = Annotated[str, msgspec.Meta(min_length=1, max_length=120)]


class _RoomEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    kind: Name
    floor: Box


class _ContainerEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    type: Name
    box: Box
    height_m: Annotated[float, msgspec.Meta(gt=0.0, le=10.0)] = 0.8
    holds: Annotated[tuple[Name, ...], msgspec.Meta(max_length=1000)] = ()


class _HouseEntry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    lios_house: int
    rooms: Annotated[dict[Name, _RoomEntry], msgspec.Meta(min_length=1, max_length=1000)]
    containers: Annotated[dict[Name, _ContainerEntry], msgspec.Meta(min_length=1, max_length=10_000)]
    start: Point
    doors: Annotated[tuple[Point, ...], msgspec.Meta(max_length=1000)] = ()


def is_house_yaml(address: str) -> bool:
    """Whether an address names a house written in YAML."""
    return address.lower().endswith(SUFFIXES)


def is_survey(data: bytes) -> bool:
    """Whether a YAML file is the survey of a real place."""
    return _has_key(data, b"lios_site:")


def is_house(data: bytes) -> bool:
    """Whether a YAML file is a house."""
    return _has_key(data, b"lios_house:")


def _has_key(data: bytes, key: bytes) -> bool:
    return any(line.startswith(key) for line in data.splitlines())


def load_house_yaml(path: Path) -> House:
    """The house of a file.

    Raises:
        FileMissing: no such file.
        MalformedFile: it is a survey, has another form, its rooms overlap, a door is on no shared wall, or a
            container is in no room.
        RoomsNotConnected: a room without a door to the others.
    """
    entry = _read(path)
    floors = {name: _sorted_box(room.floor, f"the floor of {name}", path) for name, room in entry.rooms.items()}
    for (a, one), (b, other) in combinations(floors.items(), 2):
        if min(one[2], other[2]) - max(one[0], other[0]) > NEAR_M and (
            min(one[3], other[3]) - max(one[1], other[1]) > NEAR_M
        ):
            raise MalformedFile(
                path, f"rooms {a} and {b} overlap", "Move a corner, so that they share a wall at most"
            )
    _room_with((*entry.start, *entry.start), floors, "start", path)
    plan = FloorPlan(
        name=path.stem,
        rooms=tuple(
            Room(id=RoomId(name), kind=entry.rooms[name].kind, floor=_corners(floor))
            for name, floor in floors.items()
        ),
        walls=tuple(wall for name, floor in floors.items() for wall in _walls(name, floor)),
        doors=tuple(_door(number, at, floors, path) for number, at in enumerate(entry.doors, start=1)),
        windows=(),
        containers=tuple(_container(name, c, floors, path) for name, c in entry.containers.items()),
        furniture=(),
        start=Pose(x_m=entry.start[0], y_m=entry.start[1]),
    )
    require_connected(plan)
    return House(plan=plan, contents=_contents(entry.containers))


def _read(path: Path) -> _HouseEntry:
    if not path.is_file():
        raise FileMissing(path)
    if path.stat().st_size > MAX_BYTES:
        raise MalformedFile(path, f"larger than {MAX_BYTES} bytes", COMPARE)
    data = path.read_bytes()
    if is_survey(data):
        raise MalformedFile(
            path, "a survey of a real place, and not a house", "lios record and lios spot simulate take it"
        )
    try:
        entry = msgspec.yaml.decode(data, type=_HouseEntry)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError, ValueError) as error:
        raise MalformedFile(path, " ".join(str(error).split())[:300].rstrip("."), COMPARE) from error
    if entry.lios_house != VERSION:
        raise MalformedFile(path, f"version {entry.lios_house}; this release reads {VERSION}", COMPARE)
    return entry


def _sorted_box(box: Box, what: str, path: Path) -> Box:
    """The box with its lesser corner first."""
    x0, x1 = sorted((box[0], box[2]))
    y0, y1 = sorted((box[1], box[3]))
    if not all(isfinite(n) and abs(n) <= 10_000 for n in box) or x1 - x0 < 0.05 or y1 - y0 < 0.05:
        raise MalformedFile(path, f"{what} is {list(box)}", "Give x and y of two opposite corners, in metres")
    return x0, y0, x1, y1


def _corners(box: Box) -> tuple[Point, ...]:
    x0, y0, x1, y1 = box
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def _walls(name: str, floor: Box) -> list[Wall]:
    corners = _corners(floor)
    ends = zip(corners, (*corners[1:], corners[0]), strict=True)
    return [
        Wall(id=f"wall|{name}|{side}", start=start, end=end, room=RoomId(name))
        for side, (start, end) in enumerate(ends, start=1)
    ]


def _door(number: int, at: Point, floors: Mapping[str, Box], path: Path) -> Opening:
    """The door around a point on a wall that two rooms share."""
    x, y = at
    for (a, one), (b, other) in combinations(floors.items(), 2):
        along_y = min(abs(one[2] - other[0]), abs(other[2] - one[0])) <= NEAR_M
        axis = 1 if along_y else 0
        low, high = max(one[axis], other[axis]), min(one[axis + 2], other[axis + 2])
        walls = [one[2], one[0]] if along_y else [one[3], one[1]]
        others = [other[0], other[2]] if along_y else [other[1], other[3]]
        shared = [w for w, v in zip(walls, others, strict=True) if abs(w - v) <= NEAR_M]
        across, position = (x, y) if along_y else (y, x)
        if any(abs(across - w) <= NEAR_M for w in shared) and low < position < high:
            start, end = max(position - DOOR_M / 2, low), min(position + DOOR_M / 2, high)
            ends = ((x, start), (x, end)) if along_y else ((start, y), (end, y))
            rooms = (RoomId(a), RoomId(b))
            return Opening(id=f"door|{number}", start=ends[0], end=ends[1], rooms=rooms, passable=True)
    raise MalformedFile(path, f"door {list(at)} is on no wall that two rooms share", "Move it onto one")


def _room_with(box: Box, floors: Mapping[str, Box], what: str, path: Path) -> str:
    """The room that holds a box whole."""
    for name, (x0, y0, x1, y1) in floors.items():
        if x0 - NEAR_M <= box[0] and box[2] <= x1 + NEAR_M and y0 - NEAR_M <= box[1] and box[3] <= y1 + NEAR_M:
            return name
    raise MalformedFile(path, f"{what} is in no room", "Move all of it into one room")


def _container(name: str, entry: _ContainerEntry, floors: Mapping[str, Box], path: Path) -> Container:
    box = _sorted_box(entry.box, f"the box of {name}", path)
    x0, y0, x1, y1 = box
    if name == "start":
        raise MalformedFile(path, "a container is named start", "Give it another name")
    return Container(
        id=ContainerId(name),
        type=entry.type,
        room=RoomId(_room_with(box, floors, f"container {name}", path)),
        pose=Pose(x_m=(x0 + x1) / 2, y_m=(y0 + y1) / 2),
        size_m=(x1 - x0, y1 - y0, entry.height_m),
    )


def _contents(containers: Mapping[str, _ContainerEntry]) -> dict[ContainerId, tuple[Item, ...]]:
    """Items numbered by type, in the order of the file."""
    counts: dict[str, int] = {}
    found: dict[ContainerId, tuple[Item, ...]] = {}
    for name, entry in containers.items():
        items: list[Item] = []
        for item_type in entry.holds:
            counts[item_type] = counts.get(item_type, 0) + 1
            items.append(Item(id=ItemId(f"{item_type}|{counts[item_type]}"), type=ItemType(item_type)))
        found[ContainerId(name)] = tuple(items)
    return found
