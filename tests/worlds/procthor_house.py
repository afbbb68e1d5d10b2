"""A ProcTHOR house of two rooms written by hand, in Unity's frame, for tests that change one thing in it.

Kitchen x in [0, 4], bedroom x in [4, 8], both z in [0, 4]; one door at x = 4, z in [1.5, 2.5]; a shut front door at
x in [1, 2], z = 0; a fridge with an egg against the kitchen's far wall; a bed with a pillow; a plant.
"""

from __future__ import annotations

from typing import Any


def point(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def wall(name: str, room: str, a: tuple[float, float], b: tuple[float, float]) -> dict[str, Any]:
    corners = [point(a[0], 0, a[1]), point(b[0], 0, b[1]), point(a[0], 2.5, a[1]), point(b[0], 2.5, b[1])]
    return {"id": name, "roomId": room, "polygon": corners, "material": {"name": "PureWhite"}}


def thing(name: str, kind: str, at: tuple[float, float, float], turned: float = 0, **more: Any) -> dict[str, Any]:
    return {
        "id": name,
        "objectType": kind,
        "assetId": "",
        "position": point(*at),
        "rotation": point(0, turned, 0),
        **more,
    }


def two_rooms() -> dict[str, Any]:
    kitchen = [point(0, 0, 0), point(0, 0, 4), point(4, 0, 4), point(4, 0, 0)]
    bedroom = [point(4, 0, 0), point(4, 0, 4), point(8, 0, 4), point(8, 0, 0)]
    return {
        "rooms": [
            {"id": "room|2", "roomType": "Kitchen", "floorPolygon": kitchen},
            {"id": "room|3", "roomType": "Bedroom", "floorPolygon": bedroom},
        ],
        "walls": [
            wall("wall|2|south", "room|2", (0, 0), (4, 0)),
            wall("wall|exterior|south", "exterior", (0, 0), (4, 0)),
            wall("wall|2|west", "room|2", (0, 0), (0, 4)),
            wall("wall|2|north", "room|2", (0, 4), (4, 4)),
            wall("wall|2|middle", "room|2", (4, 0), (4, 4)),
            wall("wall|3|middle", "room|3", (4, 0), (4, 4)),
            wall("wall|3|south", "room|3", (4, 0), (8, 0)),
            wall("wall|3|north", "room|3", (4, 4), (8, 4)),
            wall("wall|3|east", "room|3", (8, 0), (8, 4)),
        ],
        "doors": [
            {
                "id": "door|2|3",
                "room0": "room|2",
                "room1": "room|3",
                "wall0": "wall|2|middle",
                "wall1": "wall|3|middle",
                "holePolygon": [point(1.5, 0, 0), point(2.5, 2.1, 0)],
            },
            {
                "id": "door|1|2",
                "room0": "room|2",
                "room1": "room|2",
                "wall0": "wall|2|south",
                "wall1": "wall|exterior|south",
                "holePolygon": [point(1, 0, 0), point(2, 2.1, 0)],
            },
        ],
        "windows": [],
        "objects": [
            thing("Fridge|2|0", "Fridge", (1, 0.9, 3.6), 180, children=[thing("Egg|2|1", "Egg", (1, 1, 3.6))]),
            thing("Bed|3|0", "Bed", (7, 0.45, 3), 270, children=[thing("Pillow|3|1", "Pillow", (7, 0.9, 3))]),
            thing("HousePlant|3|2", "HousePlant", (4.4, 0.3, 0.4)),
        ],
        "metadata": {"agent": {"position": point(2, 0.9, 2), "rotation": point(0, 90, 0)}},
    }
