"""Shapes of furniture to sit and lie on: beds, sofas, chairs, stools."""

from __future__ import annotations

from dashboards.geometry.parts import ALL, FurniturePart, Parts, Size
from dashboards.geometry.shaped_storage import legs


def bed(size: Size) -> Parts:
    """Headboard at the back; a mattress, a blanket over the lower part, two pillows."""
    wide = size[1] > 1.2
    pillows = ((0.08, 0.46), (0.54, 0.92)) if wide else ((0.15, 0.85),)
    bed_top = min(0.75, 0.5 / size[2]) if size[2] > 0.65 else 0.75
    return [
        FurniturePart((0.0, 0.04), ALL, (0.0, min(1.0, 1.05 / size[2])), "wood"),
        FurniturePart((0.02, 1.0), (0.01, 0.99), (0.12 * bed_top, 0.5 * bed_top), "wood"),
        FurniturePart((0.04, 0.99), (0.03, 0.97), (0.5 * bed_top, bed_top), "white"),
        FurniturePart((0.34, 1.0), (0.01, 0.99), (0.48 * bed_top, bed_top * 1.06)),
        *[FurniturePart((0.07, 0.25), span, (bed_top, bed_top * 1.2), "white") for span in pillows],
    ]


def sofa(size: Size) -> Parts:
    arm = min(0.18, 0.16 / size[1])
    seats = max(1, min(4, round((size[1] - 0.3) / 0.65)))
    inner = 1 - 2 * arm
    parts = [
        FurniturePart((0.0, 0.25), ALL, (0.08, 1.0)),
        FurniturePart((0.0, 0.98), (0.0, arm), (0.08, 0.66)),
        FurniturePart((0.0, 0.98), (1 - arm, 1.0), (0.08, 0.66)),
        FurniturePart((0.2, 0.97), (arm, 1 - arm), (0.08, 0.36)),
    ]
    for i in range(seats):
        left, right = arm + inner * i / seats, arm + inner * (i + 1) / seats
        parts.append(FurniturePart((0.25, 1.0), (left + 0.008, right - 0.008), (0.36, 0.5)))
    return [*parts, *legs(size, 0.08, trim="dark")]


def chair(size: Size) -> Parts:
    seat = min(0.6, 0.46 / size[2]) if size[2] > 0.6 else 0.55
    return [
        FurniturePart((0.05, 1.0), (0.03, 0.97), (seat - 0.06, seat)),
        FurniturePart((0.0, 0.1), (0.03, 0.97), (seat + 0.12, 1.0)),
        *legs(size, seat - 0.06, thick_m=0.04),
        FurniturePart((0.0, 0.08), (0.05, 0.12), (seat, 1.0), "wood"),
        FurniturePart((0.0, 0.08), (0.88, 0.95), (seat, 1.0), "wood"),
    ]


def stool(size: Size) -> Parts:
    return [FurniturePart(ALL, ALL, (0.88, 1.0), "", "cylinder"), *legs(size, 0.88, thick_m=0.04, inset_m=0.06)]
