"""Shapes of smaller things: bins, bags, plants, lamps, pictures."""

from __future__ import annotations

from dashboards.geometry.parts import ALL, FurniturePart, Parts, Size


def bin(size: Size) -> Parts:
    return [
        FurniturePart(ALL, ALL, (0.0, 0.93), "", "cylinder"),
        FurniturePart((0.04, 0.96), (0.04, 0.96), (0.93, 1.0), "dark", "cylinder"),
    ]


def bag(size: Size) -> Parts:
    return [
        FurniturePart(ALL, ALL, (0.0, 0.9), "", "ball"),
        FurniturePart((0.4, 0.6), (0.4, 0.6), (0.8, 1.0), "dark", "cylinder"),
    ]


def plant(size: Size) -> Parts:
    return [
        FurniturePart((0.25, 0.75), (0.25, 0.75), (0.0, 0.32), "pot", "cylinder"),
        FurniturePart((0.45, 0.55), (0.45, 0.55), (0.3, 0.6), "wood", "cylinder"),
        FurniturePart((0.05, 0.95), (0.05, 0.95), (0.45, 1.0), "plant", "ball"),
    ]


def lamp(size: Size) -> Parts:
    return [
        FurniturePart((0.2, 0.8), (0.2, 0.8), (0.0, 0.03), "dark", "cylinder"),
        FurniturePart((0.46, 0.54), (0.46, 0.54), (0.02, 0.8), "dark", "cylinder"),
        FurniturePart((0.1, 0.9), (0.1, 0.9), (0.78, 1.0), "white", "cylinder"),
    ]


def flat(size: Size) -> Parts:
    """Pictures, mirrors, clocks: a frame with a lighter face."""
    return [FurniturePart(ALL, ALL, ALL, "fabric"), FurniturePart((0.5, 1.02), (0.08, 0.92), (0.08, 0.92), "white")]
