"""Parts of furniture: boxes, cylinders and balls, in fractions of the piece's size.

Fractions are in the body's own frame: x from back (0) to front (1), y from right (0) to left (1), z from floor (0) to
top (1). Parts of the body take the container's colour; trims keep their own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from dashboards.geometry.solids import Shape

Size = tuple[float, float, float]
Span = tuple[float, float]


@dataclass(frozen=True, slots=True)
class FurniturePart:
    """A shape between two fractions of the size along each axis; trim "" is the body."""

    x: Span
    y: Span
    z: Span
    trim: str = ""
    shape: Shape = "box"


Parts = list[FurniturePart]
Kind = Callable[[Size], Parts]
ALL: Span = (0.0, 1.0)


def block(size: Size) -> Parts:
    return [FurniturePart(ALL, ALL, ALL)]
