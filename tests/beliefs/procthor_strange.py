"""A ProcTHOR house of one room and one container, with items of any name."""

from __future__ import annotations

from typing import Any


def strange_house(*, items: tuple[str, ...]) -> dict[str, Any]:
    def point(x: float, y: float, z: float) -> dict[str, float]:
        return {"x": x, "y": y, "z": z}

    def wall(name: str, a: tuple[float, float], b: tuple[float, float]) -> dict[str, Any]:
        corners = [point(a[0], 0, a[1]), point(b[0], 0, b[1]), point(a[0], 2.5, a[1]), point(b[0], 2.5, b[1])]
        return {"id": name, "roomId": "room|2", "polygon": corners, "material": {"name": "PureWhite"}}

    def thing(name: str, kind: str, **more: Any) -> dict[str, Any]:
        at = {"position": point(2, 0.5, 2), "rotation": point(0, 0, 0), "assetId": ""}
        return {"id": name, "objectType": kind, **at, **more}

    held = [thing(f"small|2|{k}", name) for k, name in enumerate(items)]
    corners = [(0.0, 0.0), (0.0, 4.0), (4.0, 4.0), (4.0, 0.0)]
    return {
        "rooms": [{"id": "room|2", "roomType": "Kitchen", "floorPolygon": [point(x, 0, z) for x, z in corners]}],
        "walls": [
            wall(f"wall|2|{k}", a, b) for k, (a, b) in enumerate(zip(corners, corners[1:] + corners[:1], strict=True))
        ],
        "doors": [],
        "windows": [],
        "objects": [thing("Fridge|2|0", "Fridge", children=held)],
        "metadata": {"agent": {"position": point(1, 0.9, 1), "rotation": point(0, 0, 0)}},
    }
