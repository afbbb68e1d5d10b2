"""Statistics of real houses (rooms, sizes, furniture, contents), measured on the training houses.

The generator uses only these statistics. They are kept in data/house_statistics.json, made by

    lios houses stats ../shared/procthor/multi_room_train.jsonl.gz ../shared/procthor/single_room_train.jsonl.gz \\
        --split train --measure workbench/data/house_statistics.json

Objaverse types are counted under their generic name ("ObjaHairbrush" as "Hairbrush"): generated houses have items,
not assets.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from itertools import pairwise
from math import hypot, log

import msgspec
import numpy as np

from workbench.worlds.geometry import Point
from workbench.worlds.house import House, Opening, Room, Wall
from workbench.worlds.maps.connectivity import distance_to_segment
from workbench.worlds.names import generic_type

AREA_CLASSES = 3
"""Size classes of rooms: small, medium, large."""
MIN_MULTI_ROOM_CONTAINERS = 15
"""Minimum number of containers in multi-room houses for a statistic; with fewer, single-room houses are included."""
MIN_SEEN = 3
"""Item types seen less often in the training houses are never drawn, but count in the number of items."""
LEFT_OUT = frozenset({"Grenade", "Weapon", "Dagger", "Unknown"})
"""Item types that no household task names."""


class RoomShares(msgspec.Struct, frozen=True, kw_only=True):
    """Statistics of one room kind.

    Attributes:
        area_quantiles: areas in square metres: minimum, quantiles in steps of 5 %, maximum.
        log_area_sd: standard deviation of the natural logarithm of square metres.
        area_limits: boundaries of the size classes in square metres, ascending.
        furniture: per size class, per type, the share of rooms with 0, 1, 2, ... pieces.
    """

    area_quantiles: tuple[float, ...]
    log_area_sd: float
    area_limits: tuple[float, ...]
    furniture: tuple[dict[str, tuple[float, ...]], ...]


class ContentShares(msgspec.Struct, frozen=True, kw_only=True):
    """Contents statistics of a container type in a room kind.

    Attributes:
        seen: number of such containers.
        number: share of containers with 0, 1, 2, ... items.
        types: per item type (share of containers that hold one, mean number of them if there is one).
    """

    seen: int
    number: tuple[float, ...]
    types: dict[str, tuple[float, float]]


class HouseStatistics(msgspec.Struct, frozen=True, kw_only=True):
    """All statistics of a set of houses.

    Attributes:
        made_by: the command that made them.
        houses: number of measured houses.
        rooms: per number of rooms: sets of room kinds ("Bathroom Bedroom Kitchen") and the number of houses
            with each.
        kinds: statistics per room kind.
        house_log_area_sd: standard deviation of the log-area factor that the rooms of a house share.
        doors: number of doors per pair of room kinds ("Bathroom-Bedroom").
        open_walls: per pair of kinds, the share of their connections that are open walls.
        double_doors: share of interior doors wider than 1.5 m.
        contents: "Kitchen/CounterTop" or, where few were seen, "/CounterTop" -> what it holds.
    """

    made_by: str
    houses: int
    rooms: dict[str, dict[str, int]]
    kinds: dict[str, RoomShares]
    house_log_area_sd: float
    doors: dict[str, int]
    open_walls: dict[str, float]
    double_doors: float
    contents: dict[str, ContentShares]


@cache
def shipped_statistics() -> HouseStatistics:
    """The statistics that are shipped."""
    data = files("workbench").joinpath("data/house_statistics.json").read_bytes()
    return msgspec.json.decode(data, type=HouseStatistics)


def measure(houses: Sequence[House], *, made_by: str) -> HouseStatistics:
    """Statistics of some houses. Single-room houses count for furniture and contents, not for layouts."""
    plans = [house for house in houses if len(house.plan.rooms) > 1]
    kinds = sorted({room.kind for house in houses for room in house.plan.rooms})
    return HouseStatistics(
        made_by=made_by,
        houses=len(houses),
        rooms=_room_sets(plans),
        kinds={kind: _room_shares(kind, houses, plans) for kind in kinds},
        house_log_area_sd=_rounded(_house_spread(plans)),
        doors=_doors(plans),
        open_walls=_open_walls(plans),
        double_doors=_rounded(_double_doors(plans)),
        contents=_contents(houses, plans),
    )


def statistics_json(statistics: HouseStatistics) -> bytes:
    """The statistics as readable JSON, with one list or row per line."""
    text = msgspec.json.format(msgspec.json.encode(statistics), indent=1).decode()
    inner = re.compile(r"\[[^\[\]{}]*\]")
    text = inner.sub(lambda found: " ".join(found[0].split()), text)
    return (text + "\n").encode()


def area_m2(floor: Sequence[Point]) -> float:
    """Square metres of a floor polygon (shoelace formula)."""
    corners = np.array(floor)
    after = np.roll(corners, -1, axis=0)
    return abs(float((corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]).sum())) / 2


def pair_name(a: str, b: str) -> str:
    """A key for two room kinds, in alphabetical order."""
    return "-".join(sorted((a, b)))


def _room_sets(plans: Iterable[House]) -> dict[str, dict[str, int]]:
    counts: dict[int, Counter[str]] = defaultdict(Counter)
    for house in plans:
        kinds = sorted(room.kind for room in house.plan.rooms)
        counts[len(kinds)][" ".join(kinds)] += 1
    return {str(n): dict(sorted(counts[n].items())) for n in sorted(counts)}


def _room_shares(kind: str, houses: Sequence[House], plans: Sequence[House]) -> RoomShares:
    """Areas from multi-room houses; furniture from those, or from all houses if the kind is rare among them."""
    areas = [area_m2(room.floor) for house in plans for room in house.plan.rooms if room.kind == kind]
    source = plans if len(areas) >= 30 else houses
    areas = [area_m2(room.floor) for house in source for room in house.plan.rooms if room.kind == kind]
    limits = [float(x) for x in np.quantile(areas, [i / AREA_CLASSES for i in range(1, AREA_CLASSES)])]
    per_class: list[list[Counter[str]]] = [[] for _ in range(AREA_CLASSES)]
    for house in source:
        for room in house.plan.rooms:
            if room.kind == kind:
                which = sum(area_m2(room.floor) > limit for limit in limits)
                per_class[which].append(_furniture_of(house, room))
    logs = [log(area) for area in areas]
    return RoomShares(
        area_quantiles=tuple(_rounded(float(area)) for area in np.quantile(areas, np.linspace(0, 1, 21))),
        log_area_sd=_rounded(float(np.std(logs))),
        area_limits=tuple(_rounded(limit) for limit in limits),
        furniture=tuple(_number_shares(rooms) for rooms in per_class),
    )


def _furniture_of(house: House, room: Room) -> Counter[str]:
    """The number of pieces of each AI2-THOR type in a room."""
    things = (*house.plan.containers, *house.plan.furniture)
    return Counter(t.type for t in things if t.room == room.id and not t.type.startswith("Obja"))


def _number_shares(rooms: Sequence[Counter[str]]) -> dict[str, tuple[float, ...]]:
    """Per type the share of rooms with 0, 1, 2, ... of it."""
    shares: dict[str, tuple[float, ...]] = {}
    for type_name in sorted({t for room in rooms for t in room}):
        numbers = [room[type_name] for room in rooms]
        shares[type_name] = tuple(_rounded(numbers.count(n) / len(numbers)) for n in range(max(numbers) + 1))
    return shares


def _house_spread(plans: Sequence[House]) -> float:
    """Standard deviation over houses of the mean log area relative to its expectation by room kinds."""
    by_kind: dict[str, list[float]] = defaultdict(list)
    for house in plans:
        for room in house.plan.rooms:
            by_kind[room.kind].append(log(area_m2(room.floor)))
    expected = {kind: float(np.mean(values)) for kind, values in by_kind.items()}
    gaps = [np.mean([log(area_m2(r.floor)) - expected[r.kind] for r in house.plan.rooms]) for house in plans]
    return float(np.std(gaps))


def _doors(plans: Iterable[House]) -> dict[str, int]:
    counts = Counter(pair_name(*kinds) for house in plans for kinds in _door_kinds(house))
    return dict(sorted(counts.items()))


def _door_kinds(house: House) -> list[tuple[str, str]]:
    kind = {room.id: room.kind for room in house.plan.rooms}
    return [(kind[d.rooms[0]], kind[d.rooms[1]]) for d in house.plan.doors if d.passable]


def _open_walls(plans: Iterable[House]) -> dict[str, float]:
    """Share of connections between two kinds of room that are an open wall instead of a door."""
    doors: Counter[str] = Counter()
    opened: Counter[str] = Counter()
    for house in plans:
        doors.update(pair_name(*kinds) for kinds in _door_kinds(house))
        opened.update(_open_pairs(house))
    return {pair: _rounded(n / (n + doors[pair])) for pair, n in sorted(opened.items())}


def _open_pairs(house: House) -> list[str]:
    """Pairs of kinds joined by an open wall, one a pair of rooms."""
    pairs: dict[tuple[str, str], str] = {}
    for wall in house.plan.walls:
        if wall.empty:
            beside = [room for room in house.plan.rooms if _touches(wall, room)]
            for first, second in pairwise(beside):
                pairs[first.id, second.id] = pair_name(first.kind, second.kind)
    return list(pairs.values())


def _touches(wall: Wall, room: Room) -> bool:
    middle = ((wall.start[0] + wall.end[0]) / 2, (wall.start[1] + wall.end[1]) / 2)
    corners = zip(room.floor, (*room.floor[1:], room.floor[0]), strict=True)
    return any(distance_to_segment(middle, a, b) < 0.01 for a, b in corners)


def _double_doors(plans: Iterable[House]) -> float:
    widths = [_width(door) for house in plans for door in house.plan.doors if door.passable]
    return sum(width > 1.5 for width in widths) / max(1, len(widths))


def _width(door: Opening) -> float:
    return hypot(door.end[0] - door.start[0], door.end[1] - door.start[1])


def _contents(houses: Sequence[House], plans: Sequence[House]) -> dict[str, ContentShares]:
    """Contents statistics per room kind and container type, from multi-room houses where there are enough."""
    everywhere, several = _held(houses), _held(plans)
    total = Counter[str]()
    for key, containers in everywhere.items():
        if key.startswith("/"):
            for items in containers:
                total.update(items)
    kept = {t for t, n in total.items() if n >= MIN_SEEN and t not in LEFT_OUT}
    shares: dict[str, ContentShares] = {}
    for key in sorted(everywhere):
        source = several[key] if len(several.get(key, ())) >= MIN_MULTI_ROOM_CONTAINERS else everywhere[key]
        if key.startswith("/") or len(source) >= MIN_MULTI_ROOM_CONTAINERS:
            shares[key] = _content_shares(source, kept)
    return shares


def _held(houses: Iterable[House]) -> dict[str, list[Counter[str]]]:
    """The contents of each container, by "Kitchen/CounterTop" and by "/CounterTop"."""
    held: dict[str, list[Counter[str]]] = defaultdict(list)
    for house in houses:
        kind = {room.id: room.kind for room in house.plan.rooms}
        for container in house.plan.containers:
            items = Counter(generic_type(item.type) for item in house.contents[container.id])
            held[f"{kind[container.room]}/{container.type}"].append(items)
            held[f"/{container.type}"].append(items)
    return held


def _content_shares(containers: Sequence[Mapping[str, int]], kept: set[str]) -> ContentShares:
    numbers = [sum(items.values()) for items in containers]
    types: dict[str, tuple[float, float]] = {}
    for type_name in sorted({t for items in containers for t in items} & kept):
        with_it = [items[type_name] for items in containers if items.get(type_name, 0)]
        types[type_name] = (_rounded(len(with_it) / len(containers)), _rounded(sum(with_it) / len(with_it)))
    shares = tuple(_rounded(numbers.count(n) / len(numbers)) for n in range(max(numbers) + 1))
    return ContentShares(seen=len(containers), number=shares, types=types)


def _rounded(value: float) -> float:
    return round(value, 4)
