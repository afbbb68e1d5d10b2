"""Houses: a floor plan (rooms, walls, doors, containers), which the robot knows, and its contents, which only a
simulator knows.

`FloorPlan` is what a robot knows before it searches anything. `House` adds the contents, which only a simulated
world and the oracle receive, so that the types decide what planning may see.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NewType

from workbench.errors import BadValue
from workbench.worlds.geometry import Point, Pose

ContainerId = NewType("ContainerId", str)
RoomId = NewType("RoomId", str)
ItemId = NewType("ItemId", str)
ItemType = NewType("ItemType", str)
"""The type of an item in CamelCase, as in the house file: "Mug", "RemoteControl"."""
LocationId = NewType("LocationId", str)
"""A location at which the robot can stand: a container's id, or START."""

START = LocationId("start")
"""The robot's start pose. Never the id of a container."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """A room: its id, its kind ("Kitchen"), and its floor polygon in the map frame."""

    id: RoomId
    kind: str
    floor: tuple[Point, ...]

    def __post_init__(self) -> None:
        if len(self.floor) < 3:
            raise BadValue(f"floor of room {self.id}", self.floor, "a polygon of three points or more")


@dataclass(frozen=True, slots=True, kw_only=True)
class Opening:
    """A door's or window's hole in a wall: a segment on the floor with a bottom and a top."""

    id: str
    start: Point
    end: Point
    bottom_m: float = 0.0
    top_m: float = 2.1
    rooms: tuple[RoomId, ...] = ()
    passable: bool = False
    """Whether a robot can pass: true for interior doors; doors to the outside are closed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wall:
    """A straight wall; an empty one is an open passage between rooms."""

    id: str
    start: Point
    end: Point
    height_m: float = 2.5
    empty: bool = False
    room: RoomId | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Furniture:
    """A piece of furniture that is not searched: a plant, a floor lamp, a bathtub.

    size_m is (x, y, z) in its own frame; base_m is the height of its underside above the floor.
    """

    id: str
    type: str
    room: RoomId
    pose: Pose
    size_m: tuple[float, float, float]
    base_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Container:
    """A piece of furniture that can hold items: fridge, counter top, bed, dresser.

    size_m is (x, y, z) in its own frame; base_m is the height of its underside above the floor.
    """

    id: ContainerId
    type: str
    room: RoomId
    pose: Pose
    size_m: tuple[float, float, float]
    base_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Item:
    """An item in a container. Goals name item types; any instance serves."""

    id: ItemId
    type: ItemType


@dataclass(frozen=True, slots=True, weakref_slot=True, kw_only=True)
class FloorPlan:
    """The layout of a house, known before any search.

    Raises:
        BadValue: duplicate ids, a container in an unknown room, or a container named START.
    """

    name: str
    rooms: tuple[Room, ...]
    walls: tuple[Wall, ...]
    doors: tuple[Opening, ...]
    windows: tuple[Opening, ...]
    containers: tuple[Container, ...]
    furniture: tuple[Furniture, ...]
    start: Pose

    def __post_init__(self) -> None:
        rooms = {room.id for room in self.rooms}
        if not rooms:
            raise BadValue(f"rooms of {self.name}", (), "at least one room")
        ids = [container.id for container in self.containers]
        if len(set(ids)) != len(ids):
            twice = sorted({i for i in ids if ids.count(i) > 1})
            raise BadValue(f"container ids of {self.name}", twice, "different from one another")
        for container in self.containers:
            if container.room not in rooms:
                raise BadValue(f"room of container {container.id}", container.room, "a room of the house")
            if container.id == START:
                raise BadValue("container id", container.id, f"another name than {START!r}")

    def container(self, container_id: ContainerId) -> Container:
        """The container of that id.

        Raises:
            KeyError: no such container.
        """
        for container in self.containers:
            if container.id == container_id:
                return container
        raise KeyError(container_id)

    def room(self, room_id: RoomId) -> Room:
        """The room of that id.

        Raises:
            KeyError: no such room.
        """
        for room in self.rooms:
            if room.id == room_id:
                return room
        raise KeyError(room_id)


Contents = Mapping[ContainerId, tuple[Item, ...]]
"""Contents by container. An empty tuple means known to be empty; a missing entry means unknown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class House:
    """A floor plan with the true contents of every container. Only simulated worlds and the oracle receive it.

    Raises:
        BadValue: contents of a container that is not in the floor plan.
    """

    plan: FloorPlan
    contents: Contents = field(default_factory=lambda: MappingProxyType({}))

    def __post_init__(self) -> None:
        known = {container.id for container in self.plan.containers}
        strange = sorted(set(self.contents) - known)
        if strange:
            raise BadValue(f"contents of {self.plan.name}", strange, "of containers that the house has")
        complete = {c.id: tuple(self.contents.get(c.id, ())) for c in self.plan.containers}
        object.__setattr__(self, "contents", MappingProxyType(complete))

    def item_types(self) -> tuple[ItemType, ...]:
        """All item types that the house holds, sorted."""
        return tuple(sorted({item.type for items in self.contents.values() for item in items}))

    def holders(self, item_type: ItemType) -> tuple[ContainerId, ...]:
        """The containers that hold an instance of a type, in the plan's order."""
        return tuple(c.id for c in self.plan.containers if any(i.type == item_type for i in self.contents[c.id]))
