"""ProcTHOR's JSON as typed records, with the fields that are read and written here.

Source: ProcTHOR-10K and the houses of AI2-THOR 5 (schema 1.0.0). Unity's frame: y up, metres, degrees about y.
Fields missing from some layouts have defaults; unused fields are ignored.
"""

from __future__ import annotations

from typing import Any

import msgspec


class Vector(msgspec.Struct, frozen=True, kw_only=True):
    """A point or three angles in Unity's frame."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


class RoomJson(msgspec.Struct, frozen=True, kw_only=True):
    id: str
    roomType: str
    floorPolygon: tuple[Vector, ...]


class WallJson(msgspec.Struct, frozen=True, kw_only=True):
    """polygon is a vertical quadrilateral; an opening between rooms says empty, or has an empty material."""

    id: str
    polygon: tuple[Vector, ...]
    roomId: str | None = None
    empty: bool = False
    material: Any = None


class BoxJson(msgspec.Struct, frozen=True, kw_only=True):
    min: Vector
    max: Vector


class HoleJson(msgspec.Struct, frozen=True, kw_only=True):
    """A door or a window. Its hole lies in the plane of wall0, measured from that wall's polygon[0].

    The first release of ProcTHOR-10K (schema 0.0.1) gives the hole as a boundingBox instead of a polygon.
    """

    id: str
    wall0: str
    holePolygon: tuple[Vector, ...] = ()
    boundingBox: BoxJson | None = None
    room0: str | None = None
    room1: str | None = None
    wall1: str | None = None

    @property
    def corners(self) -> tuple[Vector, ...]:
        """The hole's corners, x along the wall and y up; fewer than two if the file has none."""
        if not self.holePolygon and self.boundingBox:
            return (self.boundingBox.min, self.boundingBox.max)
        return self.holePolygon


class ObjectJson(msgspec.Struct, frozen=True, kw_only=True):
    """An object with its contents. The older layout has no objectType."""

    id: str
    assetId: str | None = None
    objectType: str | None = None
    position: Vector = Vector()
    rotation: Vector = Vector()
    children: tuple[ObjectJson, ...] | None = ()


class AgentJson(msgspec.Struct, frozen=True, kw_only=True):
    position: Vector = Vector()
    rotation: Vector = Vector()


class MetadataJson(msgspec.Struct, frozen=True, kw_only=True):
    agent: AgentJson | None = None


class HouseJson(msgspec.Struct, frozen=True, kw_only=True):
    """One house, a line of a ProcTHOR file."""

    rooms: tuple[RoomJson, ...]
    walls: tuple[WallJson, ...]
    doors: tuple[HoleJson, ...] = ()
    windows: tuple[HoleJson, ...] = ()
    objects: tuple[ObjectJson, ...] = ()
    metadata: MetadataJson | None = None
