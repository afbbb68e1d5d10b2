"""The building of a ProcTHOR house: rooms, walls, doors and windows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import hypot
from typing import cast

from workbench.errors import BadValue
from workbench.tolerances import MIN_LENGTH_M
from workbench.worlds.geometry import Point
from workbench.worlds.house import Opening, Room, RoomId, Wall
from workbench.worlds.procthor.schema import HoleJson, RoomJson, WallJson
from workbench.worlds.procthor.unity_frame import point_from_unity

MAX_CORNERS = 1000
"""Most corners of a room that is accepted."""


def room_of(room: RoomJson, name: str) -> Room:
    """A room with its floor polygon.

    Raises:
        BadValue: the floor is not a valid polygon.
    """
    if len(room.floorPolygon) > MAX_CORNERS:
        raise BadValue(f"corners of room {room.id} in {name}", len(room.floorPolygon), f"at most {MAX_CORNERS}")
    floor = tuple(point_from_unity(corner, f"floor of room {room.id} in {name}") for corner in room.floorPolygon)
    return Room(id=RoomId(room.id), kind=room.roomType, floor=floor)


def walls_of(
    records: Iterable[WallJson], rooms: set[RoomId], name: str
) -> tuple[tuple[Wall, ...], dict[str, tuple[Point, Point]]]:
    """Walls without duplicates (ProcTHOR lists each wall once per side), and the ends of every wall by id."""
    kept: dict[tuple[Point, ...], Wall] = {}
    ends: dict[str, tuple[Point, Point]] = {}
    for record in records:
        where = f"wall {record.id} in {name}"
        points = [point_from_unity(corner, where) for corner in record.polygon]
        distinct = list(dict.fromkeys(points))
        if len(distinct) < 2:
            raise BadValue(f"polygon of {where}", record.polygon, "a wall with two ends")
        start, end = distinct[0], distinct[1]
        ends[record.id] = (start, end)
        empty = record.empty or _is_empty_material(record.material)
        key = tuple(sorted((round(x, 3), round(y, 3)) for x, y in (start, end)))
        twin = kept.get(key)
        room = RoomId(record.roomId) if record.roomId and record.roomId in rooms else None
        if twin is None:
            height = max(c.y for c in record.polygon) - min(c.y for c in record.polygon)
            kept[key] = Wall(id=record.id, start=start, end=end, height_m=height, empty=empty, room=room)
        elif (empty and not twin.empty) or (room and not twin.room):
            kept[key] = replace(twin, empty=twin.empty or empty, room=twin.room or room)
    return tuple(kept.values()), ends


def _is_empty_material(material: object) -> bool:
    """Whether a material is empty: it is a name in older houses, and a record with a name in newer ones."""
    name = cast(dict[str, object], material).get("name", "") if isinstance(material, dict) else material
    return isinstance(name, str) and "empty" in name.lower()


def opening_of(
    record: HoleJson, walls: Mapping[str, tuple[Point, Point]], rooms: Iterable[Room], name: str
) -> Opening:
    """A door or window, positioned from the wall's first corner; a door that names one room twice leads outside."""
    if record.wall0 not in walls:
        raise BadValue(f"wall0 of {record.id} in {name}", record.wall0, "the id of a wall of this house")
    if len(record.corners) < 2:
        raise BadValue(f"holePolygon of {record.id} in {name}", record.corners, "two corners")
    for corner in record.corners:
        point_from_unity(corner, f"holePolygon of {record.id} in {name}")
    (x0, y0), (x1, y1) = walls[record.wall0]
    length = hypot(x1 - x0, y1 - y0)
    if length < MIN_LENGTH_M:
        raise BadValue(f"length of wall {record.wall0} in {name}", length, f"long enough for {record.id}")
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
