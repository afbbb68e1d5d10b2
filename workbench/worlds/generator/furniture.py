"""Furniture of generated houses: counts drawn from the statistics, poses by a few placement rules.

Beds, fridges and dressers stand with their back to a wall; tables stand free in large rooms, with chairs around
them; nothing stands in front of a door. Pieces that do not fit are left out.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.worlds.generator.plan import Hole, PlannedHouse
from workbench.worlds.generator.rooms import PlannedRoom, Rectangle
from workbench.worlds.generator.statistics import HouseStatistics, RoomShares
from workbench.worlds.names import size_of_asset_m, usual_size_m, vocabulary

GAP_M = 0.03
DOOR_CLEARANCE_M = 0.9
FRONT_CLEARANCE_M = 0.45
TRIES = 200
ON_THE_WALL: Mapping[str, float] = {"Painting": 1.55, "Television": 1.4}
"""Wall-mounted types, and the height of their centre in metres."""
FREE_STANDING = ("DiningTable", "CoffeeTable")
SEATED = ("DiningTable", "Desk")
"""Types with chairs around them."""
COUNTERS = ("Countertop_I_4x2", "Countertop_I_6x2", "Countertop_I_8x2", "Countertop_I_10x2")
LARGE_FIRST = (
    *("CounterTop", "Bed", "Fridge", "Sofa", "DiningTable", "Dresser", "TVStand", "Desk", "Toilet", "Sink"),
    *("ShelvingUnit", "WashingMachine", "ClothesDryer", "Bathtub", "ArmChair", "CoffeeTable", "SideTable", "Cart"),
)
"""Placement order of types; others follow by name, chairs last."""
UNITS = {0: (0.0, 1.0), 90: (1.0, 0.0), 180: (0.0, -1.0), 270: (-1.0, 0.0)}
"""Unity's rotation about y in degrees -> direction of the front as (x, z)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedFurniture:
    """A piece of furniture: centre (x, y, z) and size (depth, width, height) in metres, rotation about y in
    degrees."""

    type: str
    asset: str
    room: PlannedRoom
    x: float
    y: float
    z: float
    degrees: int
    size_m: tuple[float, float, float]

    @property
    def body(self) -> Rectangle:
        """Its footprint on the floor."""
        return _rectangle(self.x, self.z, self.degrees, self.size_m)


def furnish(
    house: PlannedHouse, statistics: HouseStatistics, rng: np.random.Generator
) -> tuple[PlacedFurniture, ...]:
    """Furniture of all rooms, in the order of rooms."""
    return tuple(piece for room in house.rooms for piece in _furnish_room(room, house, statistics, rng))


def _furnish_room(
    room: PlannedRoom, house: PlannedHouse, statistics: HouseStatistics, rng: np.random.Generator
) -> list[PlacedFurniture]:
    counts = _draw_numbers(statistics.kinds[room.kind], room, rng)
    kept_free = [zone for hole in (*house.doors, house.front_door) if hole for zone in _door_zones(hole, room)]
    placed: list[PlacedFurniture] = []
    for type_name in sorted(counts, key=_turn):
        for _ in range(counts[type_name]):
            piece = _place(type_name, room, placed, kept_free, rng)
            if piece is not None:
                placed.append(piece)
    return placed


def _draw_numbers(figures: RoomShares, room: PlannedRoom, rng: np.random.Generator) -> dict[str, int]:
    """Draw the number of pieces of each type for a room of this kind and size."""
    area = room.at.width * room.at.depth
    which = sum(area > limit for limit in figures.area_limits)
    numbers: dict[str, int] = {}
    for type_name, shares in figures.furniture[which].items():
        p = np.array(shares)
        numbers[type_name] = int(rng.choice(len(p), p=p / p.sum()))
    return {type_name: n for type_name, n in numbers.items() if n}


def _turn(type_name: str) -> tuple[int, str]:
    if type_name == "Chair":
        return (len(LARGE_FIRST) + 1, type_name)
    return (LARGE_FIRST.index(type_name) if type_name in LARGE_FIRST else len(LARGE_FIRST), type_name)


def _place(
    type_name: str,
    room: PlannedRoom,
    placed: Sequence[PlacedFurniture],
    kept_free: Sequence[Rectangle],
    rng: np.random.Generator,
) -> PlacedFurniture | None:
    """The first of several random poses at which the piece fits."""
    word = vocabulary().get(type_name)
    asset = COUNTERS[int(rng.integers(len(COUNTERS)))] if type_name == "CounterTop" else (word.asset if word else "")
    size = size_of_asset_m(asset) or usual_size_m(type_name)
    middle = ON_THE_WALL.get(type_name, size[2] / 2)
    hangs = type_name in ON_THE_WALL
    for x, z, degrees in _candidates(type_name, room, size, placed, rng):
        piece = PlacedFurniture(
            type=type_name, asset=asset, room=room, x=x, y=middle, z=z, degrees=degrees, size_m=size
        )
        if _fits(piece, placed, () if hangs else kept_free, hangs=hangs):
            return piece
    return None


def _candidates(
    type_name: str,
    room: PlannedRoom,
    size: tuple[float, float, float],
    placed: Sequence[PlacedFurniture],
    rng: np.random.Generator,
) -> Iterator[tuple[float, float, int]]:
    if type_name == "Chair":
        yield from _chair_poses(size, placed, rng)
    if type_name in FREE_STANDING and min(room.at.width, room.at.depth) > size[1] + 2.2:
        for _ in range(TRIES):
            yield _random_pose(room, size, rng)
    for _ in range(TRIES):
        yield _pose_at_wall(room, size, rng)


def _chair_poses(
    size: tuple[float, float, float], placed: Sequence[PlacedFurniture], rng: np.random.Generator
) -> Iterator[tuple[float, float, int]]:
    """Poses around tables and at desks, facing them."""
    seats: list[tuple[float, float, int]] = []
    for table in placed:
        if table.type not in SEATED:
            continue
        body = table.body
        off = size[0] / 2 + GAP_M
        for degrees, (ux, uz) in UNITS.items():
            if table.type == "Desk" and degrees != (table.degrees + 180) % 360:
                continue
            length = body.depth if ux else body.width
            count = max(1, int(length / 0.65))
            for i in range(count):
                along = ((i + 0.5) / count - 0.5) * length
                x = table.x - ux * (body.width / 2 + off) + (0 if ux else along)
                z = table.z - uz * (body.depth / 2 + off) + (0 if uz else along)
                seats.append((x, z, degrees))
    for i in rng.permutation(len(seats)):
        yield seats[int(i)]


def _random_pose(
    room: PlannedRoom, size: tuple[float, float, float], rng: np.random.Generator
) -> tuple[float, float, int]:
    degrees = int(rng.choice([0, 90]))
    half = _rectangle(0, 0, degrees, size)
    margin = 0.9
    x = _between(room.at.x0 + margin + half.x1, room.at.x1 - margin - half.x1, rng)
    z = _between(room.at.z0 + margin + half.z1, room.at.z1 - margin - half.z1, rng)
    return (x, z, degrees)


def _pose_at_wall(
    room: PlannedRoom, size: tuple[float, float, float], rng: np.random.Generator
) -> tuple[float, float, int]:
    """A random pose with the back to a wall, in a corner in a third of the tries."""
    degrees = int(rng.choice([0, 90, 180, 270]))
    half = _rectangle(0, 0, degrees, size)
    at = room.at
    low_x, high_x = at.x0 + half.x1 + GAP_M, at.x1 - half.x1 - GAP_M
    low_z, high_z = at.z0 + half.z1 + GAP_M, at.z1 - half.z1 - GAP_M
    corner = rng.random() < 0.35
    along = float(rng.choice([0.0, 1.0])) if corner else float(rng.random())
    ux, uz = UNITS[degrees]
    x = (low_x if ux > 0 else high_x) if ux else low_x + along * (high_x - low_x)
    z = (low_z if uz > 0 else high_z) if uz else low_z + along * (high_z - low_z)
    return (x, z, degrees)


def _fits(
    piece: PlacedFurniture, placed: Sequence[PlacedFurniture], kept_free: Sequence[Rectangle], *, hangs: bool
) -> bool:
    """Whether a piece is inside its room, clear of doors, does not overlap others, and no front is blocked."""
    body = piece.body
    if not body.within(piece.room.at):
        return False
    if any(body.overlaps(zone) for zone in kept_free):
        return False
    for other in placed:
        if (other.type in ON_THE_WALL) != hangs:
            continue
        if body.overlaps(other.body):
            return False
        if hangs or "Chair" in (piece.type, other.type):
            continue
        if body.overlaps(_front(other)) or _front(piece).overlaps(other.body):
            return False
    return hangs or piece.type == "Chair" or _front(piece).within(_inflated(piece.room.at))


def _front(piece: PlacedFurniture) -> Rectangle:
    """The area in front of a piece that must stay clear of furniture other than chairs."""
    body, (ux, uz) = piece.body, UNITS[piece.degrees]
    return Rectangle(
        x0=body.x0 - FRONT_CLEARANCE_M * (ux < 0),
        x1=body.x1 + FRONT_CLEARANCE_M * (ux > 0),
        z0=body.z0 - FRONT_CLEARANCE_M * (uz < 0),
        z1=body.z1 + FRONT_CLEARANCE_M * (uz > 0),
    )


def _door_zones(hole: Hole, room: PlannedRoom) -> Iterator[Rectangle]:
    """The area on this room's side of a door that must stay clear; only a strip for an open wall."""
    if room.number not in (hole.side.first.number, hole.side.second.number if hole.side.second else -1):
        return
    deep = DOOR_CLEARANCE_M
    side = hole.side
    if side.x0 == side.x1:
        yield Rectangle(x0=side.x0 - deep, x1=side.x0 + deep, z0=side.z0 + hole.low, z1=side.z0 + hole.high)
    else:
        yield Rectangle(x0=side.x0 + hole.low, x1=side.x0 + hole.high, z0=side.z0 - deep, z1=side.z0 + deep)


def _rectangle(x: float, z: float, degrees: int, size: tuple[float, float, float]) -> Rectangle:
    depth, width, _ = size
    dx, dz = (width, depth) if degrees % 180 == 0 else (depth, width)
    return Rectangle(x0=x - dx / 2, x1=x + dx / 2, z0=z - dz / 2, z1=z + dz / 2)


def _inflated(at: Rectangle) -> Rectangle:
    return Rectangle(x0=at.x0 - GAP_M, z0=at.z0 - GAP_M, x1=at.x1 + GAP_M, z1=at.z1 + GAP_M)


def _between(low: float, high: float, rng: np.random.Generator) -> float:
    return (low + high) / 2 if high <= low else float(rng.uniform(low, high))
