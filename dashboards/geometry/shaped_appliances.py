"""Shapes of appliances and fittings: fridges, stoves, washers, screens, basins and tubs."""

from __future__ import annotations

from dashboards.geometry.parts import ALL, FurniturePart, Parts, Size


def fridge(size: Size) -> Parts:
    return [
        FurniturePart((0.0, 0.9), ALL, (0.02, 1.0)),
        FurniturePart((0.91, 1.0), ALL, (0.03, 0.62)),
        FurniturePart((0.91, 1.0), ALL, (0.635, 1.0)),
        FurniturePart((1.0, 1.0 + 0.04 / size[0]), (0.08, 0.13), (0.3, 0.58), "metal"),
        FurniturePart((1.0, 1.0 + 0.04 / size[0]), (0.08, 0.13), (0.68, 0.88), "metal"),
    ]


def screen(size: Size) -> Parts:
    return [
        FurniturePart((0.4, 0.6), ALL, (0.12, 1.0), "screen"),
        FurniturePart((0.1, 0.9), (0.3, 0.7), (0.0, 0.04), "dark"),
        FurniturePart((0.42, 0.58), (0.45, 0.55), (0.0, 0.14), "dark"),
    ]


def toilet(size: Size) -> Parts:
    return [
        FurniturePart((0.0, 0.28), (0.05, 0.95), (0.45, 1.0)),
        FurniturePart((0.28, 1.0), (0.12, 0.88), (0.42, 0.52), "", "cylinder"),
        FurniturePart((0.3, 0.8), (0.28, 0.72), (0.0, 0.45), "white"),
    ]


def sink(size: Size) -> Parts:
    return [
        FurniturePart((0.2, 0.8), (0.3, 0.7), (0.0, 0.75), "white"),
        FurniturePart(ALL, ALL, (0.75, 0.92)),
        FurniturePart((0.2, 0.9), (0.15, 0.85), (0.92, 0.94), "water"),
        FurniturePart((0.05, 0.12), (0.47, 0.53), (0.9, 1.0), "metal"),
    ]


def tub(size: Size) -> Parts:
    return [FurniturePart(ALL, ALL, (0.0, 0.92)), FurniturePart((0.08, 0.92), (0.06, 0.94), (0.92, 0.94), "water")]


def washer(size: Size) -> Parts:
    return [
        FurniturePart((0.0, 0.97), ALL, ALL),
        FurniturePart((0.97, 1.0), (0.2, 0.8), (0.2, 0.72), "screen"),
        FurniturePart((0.97, 1.0), (0.1, 0.9), (0.84, 0.94), "white"),
    ]


def stove(size: Size) -> Parts:
    return [
        FurniturePart((0.0, 0.96), ALL, (0.0, 0.96)),
        FurniturePart(ALL, ALL, (0.96, 1.0), "screen"),
        FurniturePart((0.96, 1.0), (0.12, 0.88), (0.2, 0.65), "screen"),
    ]
