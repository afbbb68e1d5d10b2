"""How does a bed, a fridge or a sofa look when built from a few boxes? Recognisable, at its own size.

Each kind is a small function from a size to parts. A part is a box, cylinder or ball given in shares of the size,
in the body's own frame: x from back (0) to front (1), y from right (0) to left (1), z from floor (0) to top (1).
Parts of the body take the container's colour; trims keep their own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from dashboards.geometry.solids import NOBODY, Shape, Solid
from dashboards.palette import NEUTRAL, TRIMS
from workbench.worlds.house import Container, FloorPlan, Furniture

Size = tuple[float, float, float]
Span = tuple[float, float]
SMALLEST_M = 0.01


@dataclass(frozen=True, slots=True)
class Part:
    """A shape between two shares of the size along each axis; trim "" is the body."""

    x: Span
    y: Span
    z: Span
    trim: str = ""
    shape: Shape = "box"


Parts = list[Part]
Kind = Callable[[Size], Parts]
ALL: Span = (0.0, 1.0)


def furniture_solids(plan: FloorPlan) -> tuple[Solid, ...]:
    """All containers (owned by their index in the plan) and all other furniture of a floor plan."""
    solids: list[Solid] = []
    for index, container in enumerate(plan.containers):
        solids += solids_of(container, owner=index)
    for piece in plan.furniture:
        solids += solids_of(piece, owner=NOBODY)
    return tuple(solids)


def solids_of(body: Container | Furniture, *, owner: int) -> list[Solid]:
    """One piece of furniture in the map frame. Without an owner even its body keeps a neutral colour."""
    size = (max(body.size_m[0], SMALLEST_M), max(body.size_m[1], SMALLEST_M), max(body.size_m[2], SMALLEST_M))
    made: list[Solid] = []
    for part in kind_of(body.type)(size):
        spans = (part.x, part.y, part.z)
        extent = tuple(max((b - a) * s, SMALLEST_M / 2) for (a, b), s in zip(spans, size, strict=True))
        centre = tuple(
            ((a + b) / 2 - shift) * s for (a, b), s, shift in zip(spans, size, (0.5, 0.5, 0.0), strict=True)
        )
        colour = TRIMS[part.trim] if part.trim else NEUTRAL
        mine = NOBODY if part.trim else owner
        made.append(Solid(part.shape, centre, extent, 0.0, colour, mine).placed(body.pose, body.base_m))
    return made


def kind_of(type_name: str) -> Kind:
    """The builder for a type: its own, that of a word in its name, or a plain block."""
    name = type_name.lower().removeprefix("obja")
    if name in KINDS:
        return KINDS[name]
    for word, kind in WORDS:
        if word in name:
            return kind
    return _block


def _legs(size: Size, top: float, *, thick_m: float = 0.05, trim: str = "wood", inset_m: float = 0.02) -> Parts:
    """Four legs from the floor to the share `top` of the height."""
    tx, ty = min(0.25, thick_m / size[0]), min(0.25, thick_m / size[1])
    ix, iy = min(0.1, inset_m / size[0]), min(0.1, inset_m / size[1])
    return [Part((x, x + tx), (y, y + ty), (0.0, top), trim) for x in (ix, 1 - ix - tx) for y in (iy, 1 - iy - ty)]


def _block(size: Size) -> Parts:
    return [Part(ALL, ALL, ALL)]


def _table(size: Size) -> Parts:
    top = max(0.5, 1 - 0.05 / size[2])
    return [Part(ALL, ALL, (top, 1.0)), *_legs(size, top, inset_m=0.05)]


def _desk(size: Size) -> Parts:
    top = max(0.5, 1 - 0.04 / size[2])
    drawers = Part((0.05, 0.95), (0.0, 0.3), (top * 0.35, top))
    return [Part(ALL, ALL, (top, 1.0)), drawers, *_legs(size, top)]


def _counter(size: Size) -> Parts:
    return [
        Part((0.0, 0.92), ALL, (0.0, 0.1), "dark"),
        Part((0.0, 0.96), ALL, (0.1, 0.94)),
        Part(ALL, ALL, (0.945, 1.0)),
        *_fronts(size, 0.96, (0.14, 0.9), pitch_m=0.6),
    ]


def _fronts(size: Size, x: float, z: Span, *, pitch_m: float) -> Parts:
    """Handles along the front, one every pitch."""
    count = max(1, round(size[1] / pitch_m))
    handle_x = (x, min(1.0, x + 0.02 / size[0]))
    return [
        Part(handle_x, ((i + 0.35) / count, (i + 0.65) / count), (z[1] - 0.08, z[1] - 0.05), "dark")
        for i in range(count)
    ]


def _drawers(size: Size) -> Parts:
    rows = max(2, min(5, round(size[2] / 0.25)))
    deep = 1 - 0.02 / max(size[0], 0.1)
    parts = [Part((0.0, deep), ALL, (0.04, 0.96)), Part(ALL, ALL, (0.97, 1.0))]
    parts += [
        Part((deep, 1.0), (0.04, 0.96), (0.06 + 0.9 * i / rows, 0.03 + 0.9 * (i + 1) / rows)) for i in range(rows)
    ]
    parts += [
        Part(
            (1.0, 1.0 + 0.02 / size[0]),
            (0.42, 0.58),
            (0.9 * (i + 0.55) / rows, 0.02 + 0.9 * (i + 0.55) / rows),
            "dark",
        )
        for i in range(rows)
    ]
    return parts


def _cupboard(size: Size) -> Parts:
    return [
        Part(ALL, ALL, (0.03, 1.0)),
        Part((1.0, 1.0 + 0.01 / size[0]), (0.495, 0.505), (0.06, 0.97), "dark"),
        Part((1.0, 1.0 + 0.03 / size[0]), (0.42, 0.45), (0.42, 0.58), "dark"),
        Part((1.0, 1.0 + 0.03 / size[0]), (0.55, 0.58), (0.42, 0.58), "dark"),
    ]


def _fridge(size: Size) -> Parts:
    return [
        Part((0.0, 0.9), ALL, (0.02, 1.0)),
        Part((0.91, 1.0), ALL, (0.03, 0.62)),
        Part((0.91, 1.0), ALL, (0.635, 1.0)),
        Part((1.0, 1.0 + 0.04 / size[0]), (0.08, 0.13), (0.3, 0.58), "metal"),
        Part((1.0, 1.0 + 0.04 / size[0]), (0.08, 0.13), (0.68, 0.88), "metal"),
    ]


def _bed(size: Size) -> Parts:
    """The head at the back; a mattress, a blanket over the lower part, two pillows."""
    wide = size[1] > 1.2
    pillows = ((0.08, 0.46), (0.54, 0.92)) if wide else ((0.15, 0.85),)
    bed_top = min(0.75, 0.5 / size[2]) if size[2] > 0.65 else 0.75
    return [
        Part((0.0, 0.04), ALL, (0.0, min(1.0, 1.05 / size[2])), "wood"),
        Part((0.02, 1.0), (0.01, 0.99), (0.12 * bed_top, 0.5 * bed_top), "wood"),
        Part((0.04, 0.99), (0.03, 0.97), (0.5 * bed_top, bed_top), "white"),
        Part((0.34, 1.0), (0.01, 0.99), (0.48 * bed_top, bed_top * 1.06)),
        *[Part((0.07, 0.25), span, (bed_top, bed_top * 1.2), "white") for span in pillows],
    ]


def _sofa(size: Size) -> Parts:
    arm = min(0.18, 0.16 / size[1])
    seats = max(1, min(4, round((size[1] - 0.3) / 0.65)))
    inner = 1 - 2 * arm
    parts = [
        Part((0.0, 0.25), ALL, (0.08, 1.0)),
        Part((0.0, 0.98), (0.0, arm), (0.08, 0.66)),
        Part((0.0, 0.98), (1 - arm, 1.0), (0.08, 0.66)),
        Part((0.2, 0.97), (arm, 1 - arm), (0.08, 0.36)),
    ]
    for i in range(seats):
        left, right = arm + inner * i / seats, arm + inner * (i + 1) / seats
        parts.append(Part((0.25, 1.0), (left + 0.008, right - 0.008), (0.36, 0.5)))
    return [*parts, *_legs(size, 0.08, trim="dark")]


def _chair(size: Size) -> Parts:
    seat = min(0.6, 0.46 / size[2]) if size[2] > 0.6 else 0.55
    return [
        Part((0.05, 1.0), (0.03, 0.97), (seat - 0.06, seat)),
        Part((0.0, 0.1), (0.03, 0.97), (seat + 0.12, 1.0)),
        *_legs(size, seat - 0.06, thick_m=0.04),
        Part((0.0, 0.08), (0.05, 0.12), (seat, 1.0), "wood"),
        Part((0.0, 0.08), (0.88, 0.95), (seat, 1.0), "wood"),
    ]


def _stool(size: Size) -> Parts:
    return [Part(ALL, ALL, (0.88, 1.0), "", "cylinder"), *_legs(size, 0.88, thick_m=0.04, inset_m=0.06)]


def _shelf(size: Size) -> Parts:
    boards = max(3, min(6, round(size[2] / 0.38)))
    side_y = min(0.1, 0.03 / size[1])
    parts = [
        Part(ALL, (0.0, side_y), ALL, "wood"),
        Part(ALL, (1 - side_y, 1.0), ALL, "wood"),
        Part((0.0, 0.06), ALL, ALL, "wood"),
    ]
    thick = min(0.06, 0.035 / size[2])
    return parts + [
        Part(
            (0.04, 1.0),
            (side_y, 1 - side_y),
            (i * (1 - thick) / (boards - 1), i * (1 - thick) / (boards - 1) + thick),
        )
        for i in range(boards)
    ]


def _tv_stand(size: Size) -> Parts:
    return [
        Part((0.0, 0.97), ALL, (0.12, 1.0)),
        Part((0.97, 1.0), (0.03, 0.48), (0.2, 0.9)),
        Part((0.97, 1.0), (0.52, 0.97), (0.2, 0.9)),
        *_legs(size, 0.12, trim="dark"),
    ]


def _screen(size: Size) -> Parts:
    return [
        Part((0.4, 0.6), ALL, (0.12, 1.0), "screen"),
        Part((0.1, 0.9), (0.3, 0.7), (0.0, 0.04), "dark"),
        Part((0.42, 0.58), (0.45, 0.55), (0.0, 0.14), "dark"),
    ]


def _toilet(size: Size) -> Parts:
    return [
        Part((0.0, 0.28), (0.05, 0.95), (0.45, 1.0)),
        Part((0.28, 1.0), (0.12, 0.88), (0.42, 0.52), "", "cylinder"),
        Part((0.3, 0.8), (0.28, 0.72), (0.0, 0.45), "white"),
    ]


def _sink(size: Size) -> Parts:
    return [
        Part((0.2, 0.8), (0.3, 0.7), (0.0, 0.75), "white"),
        Part(ALL, ALL, (0.75, 0.92)),
        Part((0.2, 0.9), (0.15, 0.85), (0.92, 0.94), "water"),
        Part((0.05, 0.12), (0.47, 0.53), (0.9, 1.0), "metal"),
    ]


def _tub(size: Size) -> Parts:
    return [Part(ALL, ALL, (0.0, 0.92)), Part((0.08, 0.92), (0.06, 0.94), (0.92, 0.94), "water")]


def _bin(size: Size) -> Parts:
    return [
        Part(ALL, ALL, (0.0, 0.93), "", "cylinder"),
        Part((0.04, 0.96), (0.04, 0.96), (0.93, 1.0), "dark", "cylinder"),
    ]


def _bag(size: Size) -> Parts:
    return [Part(ALL, ALL, (0.0, 0.9), "", "ball"), Part((0.4, 0.6), (0.4, 0.6), (0.8, 1.0), "dark", "cylinder")]


def _plant(size: Size) -> Parts:
    return [
        Part((0.25, 0.75), (0.25, 0.75), (0.0, 0.32), "pot", "cylinder"),
        Part((0.45, 0.55), (0.45, 0.55), (0.3, 0.6), "wood", "cylinder"),
        Part((0.05, 0.95), (0.05, 0.95), (0.45, 1.0), "plant", "ball"),
    ]


def _lamp(size: Size) -> Parts:
    return [
        Part((0.2, 0.8), (0.2, 0.8), (0.0, 0.03), "dark", "cylinder"),
        Part((0.46, 0.54), (0.46, 0.54), (0.02, 0.8), "dark", "cylinder"),
        Part((0.1, 0.9), (0.1, 0.9), (0.78, 1.0), "white", "cylinder"),
    ]


def _flat(size: Size) -> Parts:
    """Pictures, mirrors, clocks: a frame with a lighter face."""
    return [Part(ALL, ALL, ALL, "fabric"), Part((0.5, 1.02), (0.08, 0.92), (0.08, 0.92), "white")]


def _washer(size: Size) -> Parts:
    return [
        Part((0.0, 0.97), ALL, ALL),
        Part((0.97, 1.0), (0.2, 0.8), (0.2, 0.72), "screen"),
        Part((0.97, 1.0), (0.1, 0.9), (0.84, 0.94), "white"),
    ]


def _stove(size: Size) -> Parts:
    return [
        Part((0.0, 0.96), ALL, (0.0, 0.96)),
        Part(ALL, ALL, (0.96, 1.0), "screen"),
        Part((0.96, 1.0), (0.12, 0.88), (0.2, 0.65), "screen"),
    ]


def _chest(size: Size) -> Parts:
    return [
        Part(ALL, ALL, (0.0, 0.72)),
        Part(ALL, ALL, (0.75, 1.0)),
        Part((0.98, 1.02), (0.45, 0.55), (0.62, 0.8), "metal"),
    ]


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "armchair": _sofa,
        "bathtub": _tub,
        "bed": _bed,
        "chair": _chair,
        "countertop": _counter,
        "desk": _desk,
        "dresser": _drawers,
        "fridge": _fridge,
        "garbagebag": _bag,
        "garbagecan": _bin,
        "houseplant": _plant,
        "floorlamp": _lamp,
        "sink": _sink,
        "sofa": _sofa,
        "stool": _stool,
        "television": _screen,
        "toilet": _toilet,
        "tvstand": _tv_stand,
    }
)
"""Types with a shape of their own, in lower case."""

WORDS: tuple[tuple[str, Kind], ...] = (
    ("sidetable", _drawers),
    ("nightstand", _drawers),
    ("coffeetable", _table),
    ("tvstand", _tv_stand),
    ("table", _table),
    ("desk", _desk),
    ("headboard", _flat),
    ("bed", _bed),
    ("couch", _sofa),
    ("sofa", _sofa),
    ("armchair", _sofa),
    ("wheelchair", _chair),
    ("chair", _chair),
    ("stool", _stool),
    ("ottoman", _block),
    ("shel", _shelf),
    ("rack", _shelf),
    ("book", _shelf),
    ("drawer", _drawers),
    ("dresser", _drawers),
    ("commode", _drawers),
    ("sideboard", _tv_stand),
    ("cabinet", _cupboard),
    ("cupboard", _cupboard),
    ("wardrobe", _cupboard),
    ("locker", _cupboard),
    ("displaycase", _shelf),
    ("fridge", _fridge),
    ("refrigerator", _fridge),
    ("counter", _counter),
    ("washing", _washer),
    ("washer", _washer),
    ("dryer", _washer),
    ("stove", _stove),
    ("oven", _stove),
    ("microwave", _stove),
    ("safe", _cupboard),
    ("chest", _chest),
    ("box", _chest),
    ("cooler", _chest),
    ("bath", _tub),
    ("sink", _sink),
    ("toilet", _toilet),
    ("hamper", _bin),
    ("bin", _bin),
    ("trash", _bin),
    ("garbage", _bin),
    ("bucket", _bin),
    ("vase", _bin),
    ("barrel", _bin),
    ("bag", _bag),
    ("plant", _plant),
    ("tree", _plant),
    ("lamp", _lamp),
    ("light", _lamp),
    ("painting", _flat),
    ("picture", _flat),
    ("poster", _flat),
    ("mirror", _flat),
    ("frame", _flat),
    ("art", _flat),
    ("clock", _flat),
    ("television", _screen),
    ("monitor", _screen),
    ("tv", _screen),
    ("ball", lambda size: [Part(ALL, ALL, ALL, "", "ball")]),
)
"""Words within a type's name, in the order in which they are tried."""
