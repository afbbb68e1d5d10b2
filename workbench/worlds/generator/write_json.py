"""Generated houses as ProcTHOR JSON (schema 1.0.0), in Unity's frame.

Types known to AI2-THOR carry the id of an asset of about their size, so that AI2-THOR can build the house; other
types (a hairbrush, a lemon) have no asset.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from workbench.worlds.generator.furniture import PlacedFurniture
from workbench.worlds.generator.plan import Hole, PlannedHouse, Side
from workbench.worlds.generator.rooms import PlannedRoom
from workbench.worlds.names import usual_size_m, vocabulary

WALL_HEIGHT_M = 2.7
DOOR_HEIGHT_M = 2.1
WINDOW_M = (0.95, 1.95)
FLOORS = {
    "Kitchen": "DarkWoodFloors",
    "Bathroom": "WhiteTiles",
    "Bedroom": "LightWoodFloors",
    "LivingRoom": "WoodFloors",
}


def house_json(
    house: PlannedHouse,
    pieces: Sequence[PlacedFurniture],
    *,
    contents: Sequence[Sequence[str]] | None = None,
    agent: dict[str, Any] | None = None,
    rng: np.random.Generator | None = None,
) -> dict[str, Any]:
    """One house.

    Args:
        contents: item types in each piece.
        agent: the start pose in ProcTHOR's form.
        rng: draws the positions of items on their container; without it they lie in its centre.
    """
    metadata: dict[str, Any] = {"roomSpecId": f"generated-{len(house.rooms)}-room", "schema": "1.0.0", "warnings": {}}
    if agent is not None:
        metadata["agent"] = agent
    opened = {id(hole.side) for hole in house.doors if hole.opened}
    return {
        "rooms": [_room(room) for room in house.rooms],
        "walls": [wall for side in house.sides for wall in _walls(side, empty=id(side) in opened)],
        "doors": [_door(hole) for hole in (*house.doors, house.front_door) if hole is not None and not hole.opened],
        "windows": [_window(hole, number) for number, hole in enumerate(house.windows)],
        "objects": _objects(pieces, contents or [()] * len(pieces), rng),
        "proceduralParameters": {"floorColliderThickness": 1.0, "receptacleHeight": 0.7},
        "metadata": metadata,
    }


def piece_ids(pieces: Sequence[PlacedFurniture]) -> list[str]:
    """Ids of pieces: type, room and number, as in ProcTHOR: "Bed|4|0"."""
    counts: Counter[int] = Counter()
    names: list[str] = []
    for piece in pieces:
        names.append(f"{piece.type}|{piece.room.number}|{counts[piece.room.number]}")
        counts[piece.room.number] += 1
    return names


def _point(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": round(x, 3), "y": round(y, 3), "z": round(z, 3)}


def _room(room: PlannedRoom) -> dict[str, Any]:
    at = room.at
    corners = ((at.x0, at.z0), (at.x0, at.z1), (at.x1, at.z1), (at.x1, at.z0))
    return {
        "id": _room_id(room),
        "roomType": room.kind,
        "children": [],
        "ceilings": [],
        "floorPolygon": [_point(x, 0, z) for x, z in corners],
        "floorMaterial": {"name": FLOORS.get(room.kind, "WoodFloors")},
    }


def _room_id(room: PlannedRoom) -> str:
    return f"room|{room.number}"


def _wall_id(side: Side, room: PlannedRoom | None) -> str:
    owner = str(room.number) if room else "exterior"
    return f"wall|{owner}|{side.x0:.2f}|{side.z0:.2f}|{side.x1:.2f}|{side.z1:.2f}"


def _walls(side: Side, *, empty: bool) -> list[dict[str, Any]]:
    """A wall for each of the two faces of a side, as in ProcTHOR."""
    walls: list[dict[str, Any]] = []
    for room in (side.first, side.second):
        wall: dict[str, Any] = {
            "id": _wall_id(side, room),
            "roomId": _room_id(room) if room else "exterior",
            "polygon": [
                _point(side.x0, 0, side.z0),
                _point(side.x1, 0, side.z1),
                _point(side.x0, WALL_HEIGHT_M, side.z0),
                _point(side.x1, WALL_HEIGHT_M, side.z1),
            ],
            "material": {"name": "Empty" if empty else "PureWhite"},
        }
        if empty:
            wall["empty"] = True
        walls.append(wall)
    return walls


def _hole(hole: Hole, *, bottom: float, top: float) -> dict[str, Any]:
    side = hole.side
    return {
        "room0": _room_id(side.first),
        "room1": _room_id(side.second or side.first),
        "wall0": _wall_id(side, side.first),
        "wall1": _wall_id(side, side.second),
        "holePolygon": [_point(hole.low, bottom, 0), _point(hole.high, top, 0)],
        "assetPosition": _point((hole.low + hole.high) / 2, (bottom + top) / 2, 0),
    }


def _door(hole: Hole) -> dict[str, Any]:
    inner = hole.side.second is not None
    numbers = sorted((hole.side.first.number, hole.side.second.number if hole.side.second else 1))
    return {
        "id": f"door|{numbers[0]}|{numbers[1]}",
        "assetId": "Doorway_Double_7" if hole.high - hole.low > 1.5 else "Doorway_5",
        **_hole(hole, bottom=0.0, top=DOOR_HEIGHT_M),
        "openable": inner,
        "openness": int(inner),
    }


def _window(hole: Hole, number: int) -> dict[str, Any]:
    return {
        "id": f"window|{hole.side.first.number}|{number}",
        "assetId": "Window_Hung_48x32",
        **_hole(hole, bottom=WINDOW_M[0], top=WINDOW_M[1]),
    }


def _objects(
    pieces: Sequence[PlacedFurniture], contents: Sequence[Sequence[str]], rng: np.random.Generator | None
) -> list[dict[str, Any]]:
    """Furniture with its items; item numbers continue after those of the room's furniture."""
    numbers = Counter(piece.room.number for piece in pieces)
    objects: list[dict[str, Any]] = []
    for piece, name, items in zip(pieces, piece_ids(pieces), contents, strict=True):
        record = _thing(name, piece.type, piece.asset, piece.x, piece.y, piece.z, piece.degrees, kinematic=True)
        children: list[dict[str, Any]] = []
        for item in items:
            child = f"{item}|{piece.room.number}|{numbers[piece.room.number]}"
            numbers[piece.room.number] += 1
            x, y, z = _on(piece, item, rng)
            word = vocabulary().get(item)
            children.append(_thing(child, item, word.asset if word else "", x, y, z, 0, kinematic=False))
        if children:
            record["children"] = children
        objects.append(record)
    return objects


def _thing(
    name: str, type_name: str, asset: str, x: float, y: float, z: float, degrees: int, *, kinematic: bool
) -> dict[str, Any]:
    return {
        "id": name,
        "assetId": asset,
        "objectType": type_name,
        "position": _point(x, y, z),
        "rotation": {"x": 0, "y": degrees, "z": 0},
        "kinematic": kinematic,
    }


def _on(piece: PlacedFurniture, item: str, rng: np.random.Generator | None) -> tuple[float, float, float]:
    """A position on top of a piece of furniture."""
    u, v = (rng.uniform(-0.4, 0.4, size=2)) if rng is not None else (0.0, 0.0)
    body = piece.body
    top = piece.y + piece.size_m[2] / 2 + usual_size_m(item)[2] / 2
    return (piece.x + float(u) * body.width, top, piece.z + float(v) * body.depth)
