"""The house generator: houses drawn from the statistics of real houses, written as ProcTHOR JSON.

Every generated house is connected and all its containers are reachable: unreachable furniture is removed, and a house
with an inaccessible room is drawn again. The same seed gives the same house.
"""

from __future__ import annotations

import gzip
from collections.abc import Iterable, Iterator, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from workbench.errors import BadValue, Failed
from workbench.files import atomic
from workbench.worlds.generator.contents import draw_all_contents
from workbench.worlds.generator.furniture import PlacedFurniture, furnish
from workbench.worlds.generator.plan import PlannedHouse, plan_house
from workbench.worlds.generator.statistics import HouseStatistics, shipped_statistics
from workbench.worlds.generator.write_json import house_json, piece_ids
from workbench.worlds.maps.navigation import Navigation, NowhereToStand, compute
from workbench.worlds.maps.occupancy import room_labels
from workbench.worlds.procthor.load import house_from_json

MAX_ROOMS = 12
TRIES = 60
RESOLUTION_M, ROBOT_RADIUS_M = 0.1, 0.2


class NoHouse(Failed):
    """No valid house was found within the allowed tries."""

    def __init__(self, rooms: int) -> None:
        super().__init__(f"no house of {rooms} rooms in {TRIES} tries. Try another --seed or fewer rooms.")


def generate_houses(
    count: int,
    *,
    seed: int,
    rooms: tuple[int, int] = (2, 10),
    stocked: bool = False,
    statistics: HouseStatistics | None = None,
) -> Iterator[dict[str, Any]]:
    """Yield houses as ProcTHOR JSON; house i depends on the seed and i alone.

    Args:
        rooms: minimum and maximum number of rooms; within this range, numbers have their frequencies in real
            houses.
        stocked: add missing scenario items (SCENARIO_ITEMS) to houses with a kitchen.

    Raises:
        BadValue: numbers out of range.
    """
    min_rooms, max_rooms = rooms
    if not 1 <= min_rooms <= max_rooms <= MAX_ROOMS:
        raise BadValue("rooms", f"{min_rooms}-{max_rooms}", f"a range within 1-{MAX_ROOMS}")
    if count < 1:
        raise BadValue("number of houses", count, "at least 1")
    figures = statistics or shipped_statistics()
    for index in range(count):
        rng = np.random.default_rng([seed, index])
        size = _draw_size(figures, min_rooms, max_rooms, rng)
        yield generate_house(figures, rooms=size, rng=rng, stocked=stocked)


def generate_house(
    statistics: HouseStatistics, *, rooms: int, rng: np.random.Generator, stocked: bool = False
) -> dict[str, Any]:
    """Generate one house as ProcTHOR JSON.

    Raises:
        NoHouse: every try had an inaccessible room.
    """
    for _ in range(TRIES):
        plan = plan_house(statistics, rooms=rooms, rng=rng)
        pieces = _reachable(plan, furnish(plan, statistics, rng))
        if pieces is None:
            continue
        contents = draw_all_contents(
            statistics, [(piece.room.kind, piece.type) for piece in pieces], rng, stocked=stocked
        )
        empty = _navigation(house_json(plan, pieces))
        return house_json(plan, pieces, contents=contents, agent=_draw_agent(empty, rng), rng=rng)
    raise NoHouse(rooms)


def write_houses(path: Path, houses: Iterable[Mapping[str, Any]]) -> int:
    """Write houses, one per line, compressed if the name ends in .gz; the same houses give the same bytes.

    The file is written atomically. Returns the number of houses.
    """
    count = 0
    with atomic(path) as draft, draft.open("wb") as raw:
        packed = gzip.GzipFile("", "wb", 9, raw, mtime=0) if path.name.endswith(".gz") else None
        with packed or nullcontext():
            for house in houses:
                (packed or raw).write(msgspec.json.encode(house) + b"\n")
                count += 1
    return count


def _draw_size(statistics: HouseStatistics, min_rooms: int, max_rooms: int, rng: np.random.Generator) -> int:
    """Draw the number of rooms; numbers absent from real houses count as rare."""
    sizes = list(range(min_rooms, max_rooms + 1))
    weights = np.array([sum(statistics.rooms.get(str(n), {"": 1}).values()) for n in sizes], dtype=float)
    return int(rng.choice(sizes, p=weights / weights.sum()))


def _reachable(plan: PlannedHouse, pieces: tuple[PlacedFurniture, ...]) -> tuple[PlacedFurniture, ...] | None:
    """The furniture without unreachable pieces; None if furniture makes a room inaccessible."""
    while True:
        house = house_from_json(house_json(plan, pieces), name="generated")
        try:
            navigation = compute(house.plan, resolution_m=RESOLUTION_M, robot_radius_m=ROBOT_RADIUS_M)
        except NowhereToStand:
            return None
        entered = set(np.unique(room_labels(house.plan, navigation.grid)[navigation.free]).tolist())
        if len(entered) < len(plan.rooms):
            return None
        lost = set(navigation.travel.unreachable)
        if not lost:
            return pieces
        pieces = tuple(p for p, name in zip(pieces, piece_ids(pieces), strict=True) if name not in lost)


def _navigation(record: dict[str, Any]) -> Navigation:
    plan = house_from_json(record, name="generated").plan
    return compute(plan, resolution_m=RESOLUTION_M, robot_radius_m=ROBOT_RADIUS_M)


def _draw_agent(navigation: Navigation, rng: np.random.Generator) -> dict[str, Any]:
    """A random start pose on free floor, in ProcTHOR's form."""
    rows, columns = np.nonzero(navigation.free)
    which = int(rng.integers(len(rows)))
    x, z = navigation.grid.point_at(int(rows[which]), int(columns[which]))
    turned = int(rng.choice([0, 90, 180, 270]))
    return {
        "position": {"x": round(x, 3), "y": 0.95, "z": round(z, 3)},
        "rotation": {"x": 0, "y": turned, "z": 0},
        "standing": True,
        "horizon": 0,
    }
