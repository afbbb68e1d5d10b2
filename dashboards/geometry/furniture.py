"""Furniture of a floor plan as solids, built from a few boxes of the piece's own size.

Each kind is a small function from a size to parts (modules shaped_*); the tables below map types to kinds.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from dashboards.geometry.parts import ALL, FurniturePart, Kind, Span, block
from dashboards.geometry.shaped_appliances import fridge, screen, sink, stove, toilet, tub, washer
from dashboards.geometry.shaped_seats import bed, chair, sofa, stool
from dashboards.geometry.shaped_storage import chest, counter, cupboard, desk, drawers, shelf, table, tv_stand
from dashboards.geometry.shaped_things import bag, bin, flat, lamp, plant
from dashboards.geometry.solids import NO_OWNER, Solid
from dashboards.palette import NEUTRAL, TRIMS
from workbench.worlds.house import Container, FloorPlan, Furniture

MIN_DRAWN_M = 0.01


def furniture_solids(plan: FloorPlan) -> tuple[Solid, ...]:
    """All containers (owned by their index in the plan) and all other furniture of a floor plan."""
    solids: list[Solid] = []
    for index, container in enumerate(plan.containers):
        solids += solids_of(container, owner=index)
    for piece in plan.furniture:
        solids += solids_of(piece, owner=NO_OWNER)
    return tuple(solids)


def solids_of(body: Container | Furniture, *, owner: int) -> list[Solid]:
    """The solids of one piece of furniture in the map frame. Without an owner even its body keeps a neutral
    colour."""
    size = (max(body.size_m[0], MIN_DRAWN_M), max(body.size_m[1], MIN_DRAWN_M), max(body.size_m[2], MIN_DRAWN_M))
    made: list[Solid] = []
    for part in kind_of(body.type)(size):
        extent = (_wide(part.x, size[0]), _wide(part.y, size[1]), _wide(part.z, size[2]))
        x, y, z = _middle(part.x, size[0]), _middle(part.y, size[1]), _middle(part.z, size[2])
        centre = (x - size[0] / 2, y - size[1] / 2, z)
        colour = TRIMS[part.trim] if part.trim else NEUTRAL
        mine = NO_OWNER if part.trim else owner
        made.append(Solid(part.shape, centre, extent, 0.0, colour, mine).placed(body.pose, body.base_m))
    return made


def _middle(span: Span, size_m: float) -> float:
    """The middle of a part, from the piece's back, right or foot, in metres."""
    return (span[0] + span[1]) / 2 * size_m


def _wide(span: Span, size_m: float) -> float:
    return max((span[1] - span[0]) * size_m, MIN_DRAWN_M / 2)


def kind_of(type_name: str) -> Kind:
    """The builder for a type: its own, that of a word in its name, or a plain block."""
    name = type_name.lower().removeprefix("obja")
    if name in KINDS:
        return KINDS[name]
    for word, kind in WORDS:
        if word in name:
            return kind
    return block


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "armchair": sofa,
        "bathtub": tub,
        "bed": bed,
        "chair": chair,
        "countertop": counter,
        "desk": desk,
        "dresser": drawers,
        "fridge": fridge,
        "garbagebag": bag,
        "garbagecan": bin,
        "houseplant": plant,
        "floorlamp": lamp,
        "sink": sink,
        "sofa": sofa,
        "stool": stool,
        "television": screen,
        "toilet": toilet,
        "tvstand": tv_stand,
    }
)
"""Types with a shape of their own, in lower case."""

WORDS: tuple[tuple[str, Kind], ...] = (
    ("sidetable", drawers),
    ("nightstand", drawers),
    ("coffeetable", table),
    ("tvstand", tv_stand),
    ("table", table),
    ("desk", desk),
    ("headboard", flat),
    ("bed", bed),
    ("couch", sofa),
    ("sofa", sofa),
    ("armchair", sofa),
    ("wheelchair", chair),
    ("chair", chair),
    ("stool", stool),
    ("ottoman", block),
    ("shel", shelf),
    ("rack", shelf),
    ("book", shelf),
    ("drawer", drawers),
    ("dresser", drawers),
    ("commode", drawers),
    ("sideboard", tv_stand),
    ("cabinet", cupboard),
    ("cupboard", cupboard),
    ("wardrobe", cupboard),
    ("locker", cupboard),
    ("displaycase", shelf),
    ("fridge", fridge),
    ("refrigerator", fridge),
    ("counter", counter),
    ("washing", washer),
    ("washer", washer),
    ("dryer", washer),
    ("stove", stove),
    ("oven", stove),
    ("microwave", stove),
    ("safe", cupboard),
    ("chest", chest),
    ("box", chest),
    ("cooler", chest),
    ("bath", tub),
    ("sink", sink),
    ("toilet", toilet),
    ("hamper", bin),
    ("bin", bin),
    ("trash", bin),
    ("garbage", bin),
    ("bucket", bin),
    ("vase", bin),
    ("barrel", bin),
    ("bag", bag),
    ("plant", plant),
    ("tree", plant),
    ("lamp", lamp),
    ("light", lamp),
    ("painting", flat),
    ("picture", flat),
    ("poster", flat),
    ("mirror", flat),
    ("frame", flat),
    ("art", flat),
    ("clock", flat),
    ("television", screen),
    ("monitor", screen),
    ("tv", screen),
    ("ball", lambda size: [FurniturePart(ALL, ALL, ALL, "", "ball")]),
)
"""Words within a type's name, in the order in which they are tried."""
