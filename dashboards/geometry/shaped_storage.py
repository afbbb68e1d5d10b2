"""Shapes of tables and storage furniture: desks, counters, drawers, cupboards, shelves, chests."""

from __future__ import annotations

from dashboards.geometry.parts import ALL, FurniturePart, Parts, Size, Span


def legs(size: Size, top: float, *, thick_m: float = 0.05, trim: str = "wood", inset_m: float = 0.02) -> Parts:
    """Four legs from the floor to the fraction `top` of the height."""
    tx, ty = min(0.25, thick_m / size[0]), min(0.25, thick_m / size[1])
    ix, iy = min(0.1, inset_m / size[0]), min(0.1, inset_m / size[1])
    return [
        FurniturePart((x, x + tx), (y, y + ty), (0.0, top), trim)
        for x in (ix, 1 - ix - tx)
        for y in (iy, 1 - iy - ty)
    ]


def table(size: Size) -> Parts:
    top = max(0.5, 1 - 0.05 / size[2])
    return [FurniturePart(ALL, ALL, (top, 1.0)), *legs(size, top, inset_m=0.05)]


def desk(size: Size) -> Parts:
    top = max(0.5, 1 - 0.04 / size[2])
    drawers = FurniturePart((0.05, 0.95), (0.0, 0.3), (top * 0.35, top))
    return [FurniturePart(ALL, ALL, (top, 1.0)), drawers, *legs(size, top)]


def counter(size: Size) -> Parts:
    return [
        FurniturePart((0.0, 0.92), ALL, (0.0, 0.1), "dark"),
        FurniturePart((0.0, 0.96), ALL, (0.1, 0.94)),
        FurniturePart(ALL, ALL, (0.945, 1.0)),
        *fronts(size, 0.96, (0.14, 0.9), pitch_m=0.6),
    ]


def fronts(size: Size, x: float, z: Span, *, pitch_m: float) -> Parts:
    """Handles along the front, one every pitch."""
    count = max(1, round(size[1] / pitch_m))
    handle_x = (x, min(1.0, x + 0.02 / size[0]))
    return [
        FurniturePart(handle_x, ((i + 0.35) / count, (i + 0.65) / count), (z[1] - 0.08, z[1] - 0.05), "dark")
        for i in range(count)
    ]


def drawers(size: Size) -> Parts:
    rows = max(2, min(5, round(size[2] / 0.25)))
    deep = 1 - 0.02 / max(size[0], 0.1)
    parts = [FurniturePart((0.0, deep), ALL, (0.04, 0.96)), FurniturePart(ALL, ALL, (0.97, 1.0))]
    parts += [
        FurniturePart((deep, 1.0), (0.04, 0.96), (0.06 + 0.9 * i / rows, 0.03 + 0.9 * (i + 1) / rows))
        for i in range(rows)
    ]
    parts += [
        FurniturePart(
            (1.0, 1.0 + 0.02 / size[0]),
            (0.42, 0.58),
            (0.9 * (i + 0.55) / rows, 0.02 + 0.9 * (i + 0.55) / rows),
            "dark",
        )
        for i in range(rows)
    ]
    return parts


def cupboard(size: Size) -> Parts:
    return [
        FurniturePart(ALL, ALL, (0.03, 1.0)),
        FurniturePart((1.0, 1.0 + 0.01 / size[0]), (0.495, 0.505), (0.06, 0.97), "dark"),
        FurniturePart((1.0, 1.0 + 0.03 / size[0]), (0.42, 0.45), (0.42, 0.58), "dark"),
        FurniturePart((1.0, 1.0 + 0.03 / size[0]), (0.55, 0.58), (0.42, 0.58), "dark"),
    ]


def shelf(size: Size) -> Parts:
    boards = max(3, min(6, round(size[2] / 0.38)))
    side_y = min(0.1, 0.03 / size[1])
    parts = [
        FurniturePart(ALL, (0.0, side_y), ALL, "wood"),
        FurniturePart(ALL, (1 - side_y, 1.0), ALL, "wood"),
        FurniturePart((0.0, 0.06), ALL, ALL, "wood"),
    ]
    thick = min(0.06, 0.035 / size[2])
    return parts + [
        FurniturePart(
            (0.04, 1.0),
            (side_y, 1 - side_y),
            (i * (1 - thick) / (boards - 1), i * (1 - thick) / (boards - 1) + thick),
        )
        for i in range(boards)
    ]


def tv_stand(size: Size) -> Parts:
    return [
        FurniturePart((0.0, 0.97), ALL, (0.12, 1.0)),
        FurniturePart((0.97, 1.0), (0.03, 0.48), (0.2, 0.9)),
        FurniturePart((0.97, 1.0), (0.52, 0.97), (0.2, 0.9)),
        *legs(size, 0.12, trim="dark"),
    ]


def chest(size: Size) -> Parts:
    return [
        FurniturePart(ALL, ALL, (0.0, 0.72)),
        FurniturePart(ALL, ALL, (0.75, 1.0)),
        FurniturePart((0.98, 1.02), (0.45, 0.55), (0.62, 0.8), "metal"),
    ]
