"""How does a ProcTHOR house become a House? All three layouts, one frame, one vocabulary.

Unity's frame (y up, left-handed) becomes the map frame (z up, right-handed, REP-103) in one place: map x is Unity x,
map y is Unity z, heights are Unity y. A thing that is not turned in Unity faces Unity z, that is map y, and Unity
turns clockwise seen from above: yaw is pi/2 minus the angle. So x of a thing's own frame is its front, and its
size is (depth, width, height).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from math import inf, isfinite, pi, radians
from pathlib import Path

import msgspec

from workbench.errors import BadValue, MalformedFile
from workbench.worlds.assets import Asset, read_assets
from workbench.worlds.connectivity import require_connected, room_at
from workbench.worlds.geometry import MAX_COORDINATE_M, Point, Pose
from workbench.worlds.house import (
    Container,
    ContainerId,
    FloorPlan,
    Furniture,
    House,
    Item,
    ItemId,
    ItemType,
    Opening,
    Room,
    RoomId,
    Wall,
)
from workbench.worlds.house_files import (
    HouseIndexMissing,
    explain_bad_json,
    house_line,
    house_lines,
    house_stem,
    is_many,
    split_address,
)
from workbench.worlds.names import is_container, size_of_asset_m, type_of_asset, usual_size_m
from workbench.worlds.procthor_json import AgentJson, HoleJson, HouseJson, ObjectJson, RoomJson, Vector, WallJson
from workbench.worlds.room_fit import fitted

MAX_ROOMS, MAX_CORNERS = 500, 1000
"""More rooms, or corners of one room, are no house."""
STANDS_BELOW_M = 1.2
"""A thing whose middle is lower stands on the floor, so that its height is twice its middle's."""


def load_house(address: str, *, assets: Path | None = None) -> House:
    """One house: "FILE:17" of a file with one house a line, or a .json file with a single house.

    Args:
        address: the file and the index, counted from 0.
        assets: a table of asset sizes and types (asset_id, object_type, size_x_m, size_y_m, size_z_m), for exact
            sizes; without it types come from the vocabulary and sizes are usual ones.

    Raises:
        InputError: no such file, index or house; what is wrong stands in the message.
    """
    path, index = split_address(address)
    if index is None and is_many(path):
        raise HouseIndexMissing(path)
    line = house_line(path, index or 0)
    return _decoded(path, index or 0, line, read_assets(assets))


def load_houses(path: Path, *, assets: Path | None = None) -> list[House]:
    """All houses of a file, in order. Raises as load_house does."""
    return list(iter_houses(path, assets=assets))


def iter_houses(path: Path, *, assets: Path | None = None) -> Iterator[House]:
    """All houses of a file, one after the other, for files that do not fit in memory. Raises as load_house does."""
    table = read_assets(assets)
    for index, line in house_lines(Path(path)):
        yield _decoded(Path(path), index, line, table)


def house_from_json(data: object, *, name: str, assets: Mapping[str, Asset] | Path | None = None) -> House:
    """A house from parsed JSON.

    Raises:
        MalformedFile: it is no ProcTHOR house; the name stands for the file.
        InputError: rooms that are not connected, a wall that is not there, a coordinate that is not finite.
    """
    try:
        record = msgspec.convert(data, HouseJson)
    except (msgspec.ValidationError, RecursionError) as error:
        raise MalformedFile(name, f"no ProcTHOR house ({error})", "Compare it with a house of ProcTHOR-10K") from None
    table = read_assets(assets) if isinstance(assets, Path) else assets
    return house_of(record, name=name, assets=table or {})


def house_of(record: HouseJson, *, name: str, assets: Mapping[str, Asset]) -> House:
    """A house from its typed record. Raises as house_from_json does."""
    if not record.rooms:
        raise BadValue(f"rooms of {name}", [], "at least one room")
    if len(record.rooms) > MAX_ROOMS:
        raise BadValue(f"number of rooms of {name}", len(record.rooms), f"at most {MAX_ROOMS}")
    rooms = tuple(_room(room, name) for room in record.rooms)
    if len({room.id for room in rooms}) < len(rooms):
        raise BadValue(f"room ids of {name}", [room.id for room in rooms], "different from one another")
    walls, by_id = _walls(record.walls, {room.id for room in rooms}, name)
    doors = tuple(_opening(door, by_id, rooms, name) for door in record.doors)
    windows = tuple(_opening(window, by_id, rooms, name) for window in record.windows)
    containers, furniture, contents = _objects(record.objects, rooms, assets, name)
    plan = FloorPlan(
        name=name,
        rooms=rooms,
        walls=walls,
        doors=doors,
        windows=windows,
        containers=containers,
        furniture=furniture,
        start=_start(record.metadata.agent if record.metadata else None, rooms, name),
    )
    require_connected(plan)
    return House(plan=plan, contents=contents)


def pose_from_unity(position: Vector, rotation: Vector) -> Pose:
    """Where a thing of Unity's frame stands and faces in the map frame. Raises BadValue when not finite."""
    turned = rotation.y % 360 if isfinite(rotation.y) else rotation.y
    return Pose(x_m=position.x, y_m=position.z, yaw_rad=pi / 2 - radians(turned))


def _decoded(path: Path, index: int, line: bytes, assets: Mapping[str, Asset]) -> House:
    name = f"{house_stem(path)}:{index}"
    try:
        record = msgspec.json.decode(line, type=HouseJson)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        explain_bad_json(path, index, line, str(error))
    return house_of(record, name=name, assets=assets)


def _room(room: RoomJson, name: str) -> Room:
    if len(room.floorPolygon) > MAX_CORNERS:
        raise BadValue(f"corners of room {room.id} in {name}", len(room.floorPolygon), f"at most {MAX_CORNERS}")
    floor = tuple(_point(corner, f"floor of room {room.id} in {name}") for corner in room.floorPolygon)
    return Room(id=RoomId(room.id), kind=room.roomType, floor=floor)


def _point(corner: Vector, where: str) -> Point:
    for value in (corner.x, corner.y, corner.z):
        if not isfinite(value) or abs(value) > MAX_COORDINATE_M:
            raise BadValue(where, value, f"finite and within {MAX_COORDINATE_M:.0f} m")
    return (corner.x, corner.z)


def _walls(
    records: Iterable[WallJson], rooms: set[RoomId], name: str
) -> tuple[tuple[Wall, ...], dict[str, tuple[Point, Point]]]:
    """Walls without their twins (each stands once a side in ProcTHOR), and every wall's ends by its id."""
    kept: dict[tuple[Point, ...], Wall] = {}
    ends: dict[str, tuple[Point, Point]] = {}
    for record in records:
        where = f"wall {record.id} in {name}"
        points = [_point(corner, where) for corner in record.polygon]
        distinct = list(dict.fromkeys(points))
        if len(distinct) < 2:
            raise BadValue(f"polygon of {where}", record.polygon, "a wall with two ends")
        start, end = distinct[0], distinct[1]
        ends[record.id] = (start, end)
        empty = record.empty or _says_empty(record.material)
        key = tuple(sorted((round(x, 3), round(y, 3)) for x, y in (start, end)))
        twin = kept.get(key)
        room = RoomId(record.roomId) if record.roomId and record.roomId in rooms else None
        if twin is None:
            height = max(c.y for c in record.polygon) - min(c.y for c in record.polygon)
            kept[key] = Wall(id=record.id, start=start, end=end, height_m=height, empty=empty, room=room)
        elif (empty and not twin.empty) or (room and not twin.room):
            kept[key] = replace(twin, empty=twin.empty or empty, room=twin.room or room)
    return tuple(kept.values()), ends


def _says_empty(material: object) -> bool:
    """Materials are a name in older houses and a record with a name in newer ones."""
    name = material.get("name", "") if isinstance(material, dict) else material  # pyright: ignore
    return isinstance(name, str) and "empty" in name.lower()


def _opening(record: HoleJson, walls: Mapping[str, tuple[Point, Point]], rooms: Iterable[Room], name: str) -> Opening:
    """A hole in its wall, measured from the wall's first corner; a door with one room twice leads outside."""
    if record.wall0 not in walls:
        raise BadValue(f"wall0 of {record.id} in {name}", record.wall0, "the id of a wall of this house")
    if len(record.corners) < 2:
        raise BadValue(f"holePolygon of {record.id} in {name}", record.corners, "two corners")
    for corner in record.corners:
        _point(corner, f"holePolygon of {record.id} in {name}")
    (x0, y0), (x1, y1) = walls[record.wall0]
    length = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
    along = [min(max(corner.x, 0.0), length) for corner in record.corners]
    heights = [corner.y for corner in record.corners]

    def at(distance: float) -> Point:
        return (x0 + (x1 - x0) * distance / length, y0 + (y1 - y0) * distance / length)

    known = {room.id for room in rooms}
    sides = [RoomId(s) for s in dict.fromkeys(s for s in (record.room0, record.room1) if s is not None)]
    between = tuple(side for side in sides if side in known)
    return Opening(
        id=record.id,
        start=at(min(along)),
        end=at(max(along)),
        bottom_m=min(heights),
        top_m=max(heights),
        rooms=between,
        passable=len(between) == 2,
    )


def _objects(
    records: Iterable[ObjectJson], rooms: tuple[Room, ...], assets: Mapping[str, Asset], name: str
) -> tuple[tuple[Container, ...], tuple[Furniture, ...], dict[ContainerId, tuple[Item, ...]]]:
    """Containers, other furniture, and what the containers hold; every id becomes "Type|place"."""
    containers: list[Container] = []
    furniture: list[Furniture] = []
    contents: dict[ContainerId, tuple[Item, ...]] = {}
    used: set[str] = set()
    for record in records:
        type_name = _type(record, assets)
        try:
            pose = pose_from_unity(record.position, record.rotation)
        except BadValue as error:
            raise BadValue(f"position of {record.id} in {name}", str(error), "finite numbers of metres") from None
        home = room_at(rooms, pose.point)
        room = home.id
        size, base = _size(record, type_name, assets, f"{record.id} in {name}")
        if (record.assetId or "") not in assets:
            size = fitted(size, pose, home.floor)
        thing_id = _own_id(type_name, record.id, used)
        if is_container(type_name) or record.children:
            container_id = ContainerId(thing_id)
            containers.append(
                Container(id=container_id, type=type_name, room=room, pose=pose, size_m=size, base_m=base)
            )
            contents[container_id] = tuple(
                Item(id=ItemId(_own_id(_type(child, assets), child.id, used)), type=ItemType(_type(child, assets)))
                for child in record.children or ()
            )
        else:
            furniture.append(Furniture(id=thing_id, type=type_name, room=room, pose=pose, size_m=size, base_m=base))
    return tuple(containers), tuple(furniture), contents


def _type(record: ObjectJson, assets: Mapping[str, Asset]) -> str:
    """Its objectType; in the older layout what the asset table or the asset's own name says."""
    if record.objectType:
        return record.objectType
    asset_id = record.assetId or ""
    known = assets.get(asset_id)
    return known.type if known else type_of_asset(asset_id) or "ObjaUnknown"


def _own_id(type_name: str, source_id: str, used: set[str]) -> str:
    """ "Bed|4|0" stays; "2|0" becomes "Fridge|2|0" and "small|2|1" "Egg|2|1"; a second one gets "#2"."""
    head, bar, tail = source_id.partition("|")
    place = tail if bar and not head.isdigit() else source_id
    name = f"{type_name}|{place}"
    unique, number = name, 2
    while unique in used:
        unique, number = f"{name}#{number}", number + 1
    used.add(unique)
    return unique


def _size(
    record: ObjectJson, type_name: str, assets: Mapping[str, Asset], where: str
) -> tuple[tuple[float, float, float], float]:
    """(depth, width, height) and the height of the underside above the floor. Positions are of a thing's middle."""
    middle = record.position.y
    if not isfinite(middle) or abs(middle) > MAX_COORDINATE_M:
        raise BadValue(f"height of {where}", middle, f"finite and within {MAX_COORDINATE_M:.0f} m")
    asset = assets.get(record.assetId or "")
    if asset:
        size = asset.size_m
    else:
        depth, width, height = size_of_asset_m(record.assetId or "") or usual_size_m(type_name)
        size = (depth, width, 2 * middle if 0.02 < middle < STANDS_BELOW_M else height)
    return size, max(0.0, middle - size[2] / 2)


def _start(agent: AgentJson | None, rooms: tuple[Room, ...], name: str) -> Pose:
    """The agent's pose; without one the middle of the largest room, as navigation moves it to a free place."""
    if agent is not None:
        try:
            return pose_from_unity(agent.position, agent.rotation)
        except BadValue as error:
            raise BadValue(f"metadata.agent of {name}", str(error), "finite numbers of metres") from None
    extent, middle = -inf, (0.0, 0.0)
    for room in rooms:
        xs, ys = [x for x, _ in room.floor], [y for _, y in room.floor]
        area = (max(xs) - min(xs)) * (max(ys) - min(ys))
        if area > extent:
            extent, middle = area, ((max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2)
    return Pose(x_m=middle[0], y_m=middle[1])
