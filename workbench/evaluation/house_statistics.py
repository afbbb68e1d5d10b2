"""Comparison of generated and real houses: the same statistics for both, side by side.

The most informative statistic is Greedy's mean search cost, which depends on distances, on the number of
containers, and on where items are. A search is a house and an item type that it holds: from the start always to the
nearest unsearched container until an instance is found, then pick it (5) and carry it back to the start.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.generator.statistics import area_m2
from workbench.worlds.house import START, House, LocationId
from workbench.worlds.maps.navigation import Navigation, navigate
from workbench.worlds.names import generic_type, readable_name
from workbench.worlds.travel import TravelCosts

COMMONEST = 20


def house_figures(houses: Sequence[House]) -> dict[str, Any]:
    """The statistics of some houses, as plain values."""
    navigations = [navigate(house.plan) for house in houses]
    costs = [
        cost
        for house, navigation in zip(houses, navigations, strict=True)
        for cost in greedy_search_costs(house, navigation.travel)
    ]
    rooms = [room for house in houses for room in house.plan.rooms]
    held = [len(items) for house in houses for items in house.contents.values()]
    return {
        "houses": len(houses),
        "rooms": _mean([len(house.plan.rooms) for house in houses]),
        "area_m2": _mean([sum(area_m2(room.floor) for room in house.plan.rooms) for house in houses]),
        "room_area_m2": {
            kind: _mean([area_m2(room.floor) for room in rooms if room.kind == kind])
            for kind in sorted({room.kind for room in rooms})
        },
        "doors": _mean([sum(door.passable for door in house.plan.doors) for house in houses]),
        "containers": _mean([len(house.plan.containers) for house in houses]),
        "reachable_share": _reachable(houses, navigations),
        "empty_container_share": _mean([n == 0 for n in held]),
        "items": _mean([sum(map(len, house.contents.values())) for house in houses]),
        "item_types": _mean([len(house.item_types()) for house in houses]),
        "mean_distance_m": _mean([_mean_distance(navigation.travel) for navigation in navigations]),
        "searches": len(costs),
        "greedy_search_cost": _mean(costs),
    }


def greedy_search_costs(house: House, travel: TravelCosts) -> list[float]:
    """Greedy's cost for each reachable item type of a house, in the order of types."""
    order: list[tuple[LocationId, float]] = []
    left = [place for place in travel.locations if place != START]
    here, walked = START, 0.0
    while left:
        row = travel.metres[travel.index(here)]
        near = min(left, key=lambda place: float(row[travel.index(place)]))
        walked += float(row[travel.index(near)]) + SIMULATION_COSTS.search
        order.append((near, walked))
        left.remove(near)
        here = near
    costs: list[float] = []
    for item_type in house.item_types():
        holders = {LocationId(holder) for holder in house.holders(item_type)}
        for place, walked in order:
            if place in holders:
                back = float(travel.metres[travel.index(place), travel.index(START)])
                costs.append(walked + SIMULATION_COSTS.manipulation + back)
                break
    return costs


def where_items_are(columns: Mapping[str, Sequence[House]]) -> list[dict[str, Any]]:
    """The most frequent item types of the first column: number per house and containers, for each column.

    Rows of {"item", "houses", "per_house", "where": [[container, share], ...]}.
    """
    places = {title: _places(houses) for title, houses in columns.items()}
    first = next(iter(places.values()), {})
    commonest = sorted(first, key=lambda item: (-first[item].total(), item))[:COMMONEST]
    rows: list[dict[str, Any]] = []
    for item in commonest:
        for title, houses in columns.items():
            found = places[title].get(item, Counter())
            total = found.total()
            top = [[readable_name(c), round(n / total, 3)] for c, n in found.most_common(3)] if total else []
            per_house = round(total / max(1, len(houses)), 3)
            rows.append({"item": readable_name(item), "houses": title, "per_house": per_house, "where": top})
    return rows


def _places(houses: Sequence[House]) -> dict[str, Counter[str]]:
    """The container types of the instances of each generic item type."""
    places: dict[str, Counter[str]] = {}
    for house in houses:
        for container in house.plan.containers:
            for item in house.contents[container.id]:
                places.setdefault(generic_type(item.type), Counter())[container.type] += 1
    return places


def _reachable(houses: Sequence[House], navigations: Sequence[Navigation]) -> float:
    total = sum(len(house.plan.containers) for house in houses)
    lost = sum(len(navigation.travel.unreachable) for navigation in navigations)
    return 1.0 if total == 0 else (total - lost) / total


def _mean_distance(travel: TravelCosts) -> float:
    n = len(travel.locations)
    return float(travel.metres.sum()) / (n * (n - 1)) if n > 1 else 0.0


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else 0.0
