"""Floor plans of generated houses: walls between laid-out rooms, and a spanning tree of doors and open walls.

Door frequencies per pair of room kinds, and shares of open walls, follow data/house_statistics.json. Coordinates
are Unity's (x, z), so that writing ProcTHOR's JSON needs no conversion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from workbench.errors import Failed
from workbench.tolerances import MIN_LENGTH_M, NO_CHANCE
from workbench.worlds.generator.rooms import PlannedRoom, Rectangle, cut_rooms, draw_areas, draw_kinds, is_livable
from workbench.worlds.generator.statistics import HouseStatistics, pair_name

DOOR_M, DOUBLE_DOOR_M = 1.04, 1.95
CUTS = 40
"""Layout attempts for given room sizes before new sizes are drawn; with fewer, small rooms would be too rare."""
TRIES = 400


class NoFloorPlan(Failed):
    """No floor plan was found within the allowed tries."""

    def __init__(self, rooms: int, tries: int) -> None:
        super().__init__(f"no floor plan of {rooms} rooms in {tries} tries. Try another --seed or fewer rooms.")


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """A straight wall segment between two rooms, or between a room and the outside (second is None).

    Either x0 = x1 or z0 = z1; the first end has the smaller coordinates.
    """

    first: PlannedRoom
    second: PlannedRoom | None
    x0: float
    z0: float
    x1: float
    z1: float

    @property
    def length(self) -> float:
        return (self.x1 - self.x0) + (self.z1 - self.z0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hole:
    """A door or window in a side, from `low` to `high` metres along it; `opened` if the whole side is an
    open wall."""

    side: Side
    low: float
    high: float
    opened: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedHouse:
    """The rooms and walls of a generated house, with its doors and windows, before furniture."""

    rooms: tuple[PlannedRoom, ...]
    sides: tuple[Side, ...]
    doors: tuple[Hole, ...]
    front_door: Hole | None
    windows: tuple[Hole, ...]


def plan_house(statistics: HouseStatistics, *, rooms: int, rng: np.random.Generator) -> PlannedHouse:
    """Draw the rooms, walls, doors and windows of a house.

    Raises:
        NoFloorPlan: no plan was found in TRIES tries.
    """
    areas: list[tuple[str, float]] = []
    for turn in range(TRIES):
        if turn % CUTS == 0:
            areas = draw_areas(statistics, draw_kinds(statistics, rooms, rng), rng)
        placed = cut_rooms(areas, rng)
        if placed is None or not all(is_livable(room) for room in placed):
            continue
        sides = _sides(placed)
        doors = _join(statistics, placed, sides, rng)
        if doors is not None:
            outside = [side for side in sides if side.second is None and side.length >= 1.6]
            windows = tuple(_windows(outside, rng))
            return PlannedHouse(
                rooms=placed, sides=sides, doors=doors, front_door=_front_door(outside, windows, rng), windows=windows
            )
    raise NoFloorPlan(rooms, TRIES)


def _sides(rooms: Sequence[PlannedRoom]) -> tuple[Side, ...]:
    """All walls: segments shared by two rooms (once), and the rest of each room's edges as outer walls."""
    sides: list[Side] = []
    for room in rooms:
        for edge in _edges(room.at):
            taken: list[tuple[float, float]] = []
            for other in rooms:
                if other is room:
                    continue
                shared = _shared(edge, other.at)
                if shared is not None:
                    taken.append(shared)
                    if other.number > room.number:
                        sides.append(_side(room, other, edge, *shared))
            sides.extend(_side(room, None, edge, low, high) for low, high in _rest(edge, taken))
    return tuple(sides)


Edge = tuple[bool, float, float, float]
"""(along x, the other coordinate, low, high)."""


def _edges(at: Rectangle) -> tuple[Edge, ...]:
    return (
        (True, at.z0, at.x0, at.x1),
        (True, at.z1, at.x0, at.x1),
        (False, at.x0, at.z0, at.z1),
        (False, at.x1, at.z0, at.z1),
    )


def _shared(edge: Edge, other: Rectangle) -> tuple[float, float] | None:
    """The part of an edge that it shares with an edge of another room."""
    along_x, level, low, high = edge
    for other_along_x, other_level, other_low, other_high in _edges(other):
        if along_x == other_along_x and abs(level - other_level) < MIN_LENGTH_M:
            start, end = max(low, other_low), min(high, other_high)
            if end - start > MIN_LENGTH_M:
                return (start, end)
    return None


def _rest(edge: Edge, taken: list[tuple[float, float]]) -> list[tuple[float, float]]:
    _, _, reached, end = edge
    rest: list[tuple[float, float]] = []
    for low, high in sorted(taken):
        if low - reached > MIN_LENGTH_M:
            rest.append((reached, low))
        reached = max(reached, high)
    if end - reached > MIN_LENGTH_M:
        rest.append((reached, end))
    return rest


def _side(first: PlannedRoom, second: PlannedRoom | None, edge: Edge, low: float, high: float) -> Side:
    along_x, level, _, _ = edge
    x0, x1 = (low, high) if along_x else (level, level)
    z0, z1 = (level, level) if along_x else (low, high)
    return Side(first=first, second=second, x0=x0, z0=z0, x1=x1, z1=z1)


def _join(
    statistics: HouseStatistics, rooms: Sequence[PlannedRoom], sides: Sequence[Side], rng: np.random.Generator
) -> tuple[Hole, ...] | None:
    """A random spanning tree of doors over all rooms, likely pairs of kinds first; None if the rooms are not
    adjacent."""
    inner = [side for side in sides if side.second is not None and side.length >= DOOR_M + 0.3]
    keys = [-log(max(rng.random(), NO_CHANCE)) / _weight(statistics, side) for side in inner]
    group = {room.number: room.number for room in rooms}
    doors: list[Hole] = []
    for _, side in sorted(zip(keys, inner, strict=True), key=lambda pair: pair[0]):
        assert side.second is not None
        a, b = group[side.first.number], group[side.second.number]
        if a != b:
            group = {number: (a if root == b else root) for number, root in group.items()}
            doors.append(_door(statistics, side, rng))
    return tuple(doors) if len(set(group.values())) == 1 else None


def _weight(statistics: HouseStatistics, side: Side) -> float:
    second = side.second.kind if side.second else ""
    return statistics.doors.get(pair_name(side.first.kind, second), 0) + 1.0


def _door(statistics: HouseStatistics, side: Side, rng: np.random.Generator) -> Hole:
    second = side.second.kind if side.second else ""
    if rng.random() < statistics.open_walls.get(pair_name(side.first.kind, second), 0.0):
        return Hole(side=side, low=0.0, high=side.length, opened=True)
    wide = side.length >= DOUBLE_DOOR_M + 0.6 and rng.random() < statistics.double_doors
    return _hole(side, DOUBLE_DOOR_M if wide else DOOR_M, rng)


def _hole(side: Side, width: float, rng: np.random.Generator) -> Hole:
    low = round(float(rng.uniform(0.1, side.length - width - 0.1)), 2)
    return Hole(side=side, low=low, high=round(low + width, 2))


def _windows(outside: Sequence[Side], rng: np.random.Generator) -> list[Hole]:
    return [_hole(side, 1.2, rng) for side in outside if side.length >= 2.0 and rng.random() < 0.4]


def _front_door(outside: Sequence[Side], windows: Sequence[Hole], rng: np.random.Generator) -> Hole | None:
    """A closed door to the outside, in a living room or kitchen if one has an outer wall without a window."""
    taken = [window.side for window in windows]
    free = [side for side in outside if side not in taken]
    liked = [side for side in free if side.first.kind in ("LivingRoom", "Kitchen")] or free
    return _hole(liked[int(rng.integers(len(liked)))], DOOR_M, rng) if liked else None
