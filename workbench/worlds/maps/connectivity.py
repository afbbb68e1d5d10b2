"""Connectivity of rooms through interior doors and open walls, and the lookup of the room at a point."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from workbench.errors import Malformed
from workbench.tolerances import MIN_LENGTH_M
from workbench.worlds.geometry import Point
from workbench.worlds.house import FloorPlan, Room, RoomId, Wall

PROBE_M = 0.15
"""Distance on either side of an open wall at which its rooms are looked up."""


class RoomsNotConnected(Malformed):
    """Some rooms cannot be entered from the others."""

    def __init__(self, name: str, apart: Sequence[RoomId], total: int) -> None:
        shown = ", ".join(apart[:5]) + (", ..." if len(apart) > 5 else "")
        super().__init__(
            f"{name}: {len(apart)} of {total} rooms cannot be entered from the others ({shown}). "
            "Give them a door between two rooms, or an open wall."
        )


def require_connected(plan: FloorPlan) -> None:
    """Check that every room can be entered from every other one, ignoring furniture.

    Raises:
        RoomsNotConnected: names the rooms outside the largest connected group.
    """
    joined: dict[RoomId, RoomId] = {room.id: room.id for room in plan.rooms}

    def root(room: RoomId) -> RoomId:
        while joined[room] != room:
            joined[room] = joined[joined[room]]
            room = joined[room]
        return room

    for door in plan.doors:
        if door.passable:
            first = root(door.rooms[0])
            for other in door.rooms[1:]:
                joined[root(other)] = first
    for wall in plan.walls:
        if wall.empty:
            beside = rooms_beside(wall, plan.rooms)
            for other in beside[1:]:
                joined[root(other)] = root(beside[0])
    groups: dict[RoomId, list[RoomId]] = {}
    for room in plan.rooms:
        groups.setdefault(root(room.id), []).append(room.id)
    largest = max(groups.values(), key=len)
    if len(largest) < len(plan.rooms):
        raise RoomsNotConnected(plan.name, [r.id for r in plan.rooms if r.id not in largest], len(plan.rooms))


def room_at(rooms: Sequence[Room], point: Point) -> Room:
    """The room that contains a point, or else the nearest room."""
    for room in rooms:
        if inside(point, room.floor):
            return room
    return min(rooms, key=lambda room: distance_to_polygon(point, room.floor))


def inside(point: Point, polygon: Sequence[Point]) -> bool:
    """Whether a point is in a polygon (even-odd rule)."""
    x, y = point
    result = False
    for (x0, y0), (x1, y1) in zip(polygon, (*polygon[1:], polygon[0]), strict=True):
        if (y0 > y) != (y1 > y) and x < x0 + (x1 - x0) * (y - y0) / (y1 - y0):
            result = not result
    return result


def distance_to_polygon(point: Point, polygon: Sequence[Point]) -> float:
    """Distance in metres from a point to the boundary of a polygon."""
    return min(distance_to_segment(point, a, b) for a, b in zip(polygon, (*polygon[1:], polygon[0]), strict=True))


def distance_to_segment(point: Point, a: Point, b: Point) -> float:
    """Distance in metres from a point to the segment from a to b."""
    (x, y), (x0, y0), (x1, y1) = point, a, b
    square = (x1 - x0) ** 2 + (y1 - y0) ** 2
    t = 0.0 if square == 0 else min(1.0, max(0.0, ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / square))
    return hypot(x - x0 - t * (x1 - x0), y - y0 - t * (y1 - y0))


def rooms_beside(wall: Wall, rooms: Sequence[Room]) -> tuple[RoomId, ...]:
    """The rooms on both sides of a wall, along its length."""
    (x0, y0), (x1, y1) = wall.start, wall.end
    length = hypot(x1 - x0, y1 - y0)
    if length < MIN_LENGTH_M:
        return ()
    found: dict[RoomId, None] = {}
    normal = (-(y1 - y0) / length * PROBE_M, (x1 - x0) / length * PROBE_M)
    for t in (0.25, 0.5, 0.75):
        x, y = x0 + t * (x1 - x0), y0 + t * (y1 - y0)
        for side in (1, -1):
            probe = (x + side * normal[0], y + side * normal[1])
            for room in rooms:
                if inside(probe, room.floor):
                    found[room.id] = None
    return tuple(found)
