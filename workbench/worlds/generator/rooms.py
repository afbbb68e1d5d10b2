"""Room layouts of generated houses: kinds and sizes are drawn, and a rectangle is cut into the rooms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import erf, sqrt

import numpy as np

from workbench.worlds.generator.statistics import HouseStatistics

MIN_SIDE_M = {"Bathroom": 1.8}
DEFAULT_MIN_SIDE_M = 2.5
MAX_ASPECT = 3.0
GAP = "gap"
"""A part of the rectangle that stays empty, so that not every house is rectangular."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rectangle:
    """x from x0 to x1, z from z0 to z1, in metres."""

    x0: float
    z0: float
    x1: float
    z1: float

    @property
    def width(self) -> float:
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        return self.z1 - self.z0

    def overlaps(self, other: Rectangle) -> bool:
        apart = self.x1 <= other.x0 or other.x1 <= self.x0 or self.z1 <= other.z0 or other.z1 <= self.z0
        return not apart

    def within(self, other: Rectangle) -> bool:
        return self.x0 >= other.x0 and self.x1 <= other.x1 and self.z0 >= other.z0 and self.z1 <= other.z1


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedRoom:
    """number: as in ProcTHOR's ids, "room|2"; numbers start at 2."""

    number: int
    kind: str
    at: Rectangle


def draw_kinds(statistics: HouseStatistics, rooms: int, rng: np.random.Generator) -> list[str]:
    """Draw the kinds of so many rooms with their frequencies in real houses; unseen numbers extend the
    nearest one."""
    known = sorted(statistics.rooms, key=lambda n: (abs(int(n) - rooms), int(n)))
    sets = statistics.rooms[known[0]]
    weights = np.array(list(sets.values()), dtype=float)
    kinds = list(sets)[rng.choice(len(sets), p=weights / weights.sum())].split()
    while len(kinds) > rooms:
        kinds.remove(max(kinds, key=kinds.count))
    while len(kinds) < rooms:
        kinds.append(["Bedroom", "Bathroom", "LivingRoom"][(rooms - len(kinds)) % 3])
    return kinds


def draw_areas(
    statistics: HouseStatistics, kinds: Sequence[str], rng: np.random.Generator
) -> list[tuple[str, float]]:
    """Draw the area of each room in square metres, with a factor shared by the house and a factor per room."""
    shared = rng.normal()
    between = statistics.house_log_area_sd
    areas: list[tuple[str, float]] = []
    for kind in kinds:
        figures = statistics.kinds[kind]
        own_sd = sqrt(max(0.0, figures.log_area_sd**2 - between**2))
        normal = (between * shared + own_sd * rng.normal()) / (sqrt(between**2 + own_sd**2) or 1.0)
        share = (1 + erf(normal / sqrt(2))) / 2
        sizes = figures.area_quantiles
        areas.append((kind, float(np.interp(share, np.linspace(0, 1, len(sizes)), sizes))))
    return areas


def cut_rooms(areas: list[tuple[str, float]], rng: np.random.Generator) -> tuple[PlannedRoom, ...] | None:
    """Cut a rectangle into rooms of about the given areas, in an order that keeps bathrooms near bedrooms."""
    order = [areas[i] for i in rng.permutation(len(areas))]
    order = sorted(order, key=_is_for_sleep)
    if len(order) >= 3 and rng.random() < 0.75:
        order.insert(int(rng.choice([0, len(order)])), (GAP, order[0][1] * float(rng.uniform(0.4, 1.2))))
    total = sum(area for _, area in order)
    ratio = float(rng.uniform(0.55, 1.8))
    whole = Rectangle(x0=0.0, z0=0.0, x1=_decimetres(sqrt(total * ratio)), z1=_decimetres(sqrt(total / ratio)))
    pieces = _cut_piece(whole, order, rng)
    rooms = [piece for piece in pieces if piece[0] != GAP]
    if any(piece.width <= 0 or piece.depth <= 0 for _, piece in rooms):
        return None
    return tuple(PlannedRoom(number=i + 2, kind=kind, at=at) for i, (kind, at) in enumerate(rooms))


def _is_for_sleep(part: tuple[str, float]) -> bool:
    return part[0] in ("Bathroom", "Bedroom")


def _cut_piece(
    piece: Rectangle, parts: list[tuple[str, float]], rng: np.random.Generator
) -> list[tuple[str, Rectangle]]:
    if len(parts) == 1:
        return [(parts[0][0], piece)]
    middle = len(parts) / 2
    at = int(np.clip(round(middle + rng.uniform(-1, 1) * (len(parts) > 2)), 1, len(parts) - 1))
    share = sum(area for _, area in parts[:at]) / sum(area for _, area in parts)
    if piece.width >= piece.depth:
        x = _decimetres(piece.x0 + share * piece.width)
        one = Rectangle(x0=piece.x0, z0=piece.z0, x1=x, z1=piece.z1)
        two = Rectangle(x0=x, z0=piece.z0, x1=piece.x1, z1=piece.z1)
    else:
        z = _decimetres(piece.z0 + share * piece.depth)
        one = Rectangle(x0=piece.x0, z0=piece.z0, x1=piece.x1, z1=z)
        two = Rectangle(x0=piece.x0, z0=z, x1=piece.x1, z1=piece.z1)
    return [*_cut_piece(one, parts[:at], rng), *_cut_piece(two, parts[at:], rng)]


def is_livable(room: PlannedRoom) -> bool:
    """Whether the proportions of a room are acceptable."""
    least = MIN_SIDE_M.get(room.kind, DEFAULT_MIN_SIDE_M)
    short, long = sorted((room.at.width, room.at.depth))
    return short >= least and long <= MAX_ASPECT * short


def _decimetres(value: float) -> float:
    return round(value, 1)
