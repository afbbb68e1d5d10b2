"""Placement model of `best`: hand-solved exclusion among containers, recovered kinds, and names never seen in
training."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import prod

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from learnable import learnable_house

from workbench.arrays import Floats32
from workbench.beliefs.placement_mixture import (
    MIN_RATE,
    FitSettings,
    PlacementCounts,
    duplicate_probability,
    fit_kinds,
    rates_of,
    tally,
)
from workbench.beliefs.placements import (
    condition_on_existence,
    exclude_furniture_rooms,
    placements_from,
    share_among_rivals_numpy,
)
from workbench.worlds.geometry import Pose
from workbench.worlds.house import ContainerId, FloorPlan, Furniture, House, Item, ItemId, ItemType, RoomId

QUICK = FitSettings(kinds=2, rounds=20, runs=2)


def brute_force_rivals(rates: list[float], room: list[int]) -> list[float]:
    """All ways in which containers would take the thing; of the takers of a room one is drawn."""
    chance = [0.0] * len(rates)
    for takes in product((False, True), repeat=len(rates)):
        weight = prod(p if t else 1 - p for p, t in zip(rates, takes, strict=True))
        for k, t in enumerate(takes):
            if t:
                rivals = sum(takes[j] for j in range(len(rates)) if room[j] == room[k])
                chance[k] += weight / rivals
    return chance


def test_rivals_by_hand() -> None:
    """Two tables of one room, 1/2 each: one alone has it with 1/4, both with 1/4 and then either; elsewhere a bed."""
    rates, room = np.array([[0.5, 0.5, 1 / 3]]), np.array([0, 0, 1])
    assert share_among_rivals_numpy(rates, room) == pytest.approx(np.array([[0.375, 0.375, 1 / 3]]))
    anywhere = 1 - 0.5 * 0.5 * 2 / 3
    once = condition_on_existence(rates, np.zeros(1), room)
    assert once == pytest.approx(np.array([[0.375, 0.375, 1 / 3]]) / anywhere)
    free = condition_on_existence(rates, np.ones(1), room)
    assert free == pytest.approx(rates / anywhere)
    half = condition_on_existence(rates, np.full(1, 0.5), room)
    assert half == pytest.approx((once + free) / 2)


@given(
    st.lists(st.tuples(st.floats(1e-6, 0.9), st.integers(0, 2)), min_size=1, max_size=7),
)
def test_rivals_are_those_of_all_ways(containers: list[tuple[float, int]]) -> None:
    rates, room = [c[0] for c in containers], [c[1] for c in containers]
    fast = share_among_rivals_numpy(np.array([rates]), np.array(room))
    assert fast[0] == pytest.approx(brute_force_rivals(rates, room), abs=1e-12)


def test_what_stands_in_a_room_is_not_in_its_containers() -> None:
    """A plant on the floor of room 0: none on its tables, where rooms have plants once; books do not mind others."""
    rates, room = np.full((2, 3), 0.2), np.array([0, 0, 1])
    stands = [("Plant", "Book"), ("Lamp",)]
    left = exclude_furniture_rooms(rates, np.array([0.0, 1.0]), ("Plant", "Book"), room, stands)
    assert left[0] == pytest.approx([MIN_RATE, MIN_RATE, 0.2])
    assert left[1] == pytest.approx([0.2, 0.2, 0.2])
    assert exclude_furniture_rooms(np.zeros((0, 3)), np.zeros(0), (), room, stands).shape == (0, 3)


def test_rooms_with_furniture_of_a_type_teach_that_a_room_has_it_once() -> None:
    """In half of the houses a mug stands about as furniture, and then none is on the counters."""
    houses = []
    for k in range(40):
        house = with_counters(learnable_house(k), forks_on=0)
        if k % 2:
            mug = Furniture(
                id="Mug|f", type="Mug", room=RoomId("k"), pose=Pose(x_m=1.0, y_m=1.0), size_m=(0.1, 0.1, 0.1)
            )
            contents = {c: tuple(i for i in items if i.type != "Mug") for c, items in house.contents.items()}
            house = House(plan=replace(house.plan, furniture=(mug,)), contents=contents)
        else:
            second = ContainerId("CounterTop|2")
            contents = {**house.contents, second: ()}
            house = House(plan=house.plan, contents=contents)
        houses.append(house)
    found = tally(houses)
    at = found.items.index("Mug")
    assert found.stood[at].sum() == 40 * 6 - 20 * 3, "the kitchens with a mug as furniture are not counted"
    assert found.stood[found.items.index("Fork")].sum() == 40 * 6
    rates = np.clip(found.held / np.maximum(found.stood, 1.0), 0.0, 0.9)
    assert duplicate_probability(rates, found, houses)[at] < 0.01


def test_what_cannot_be_seen_has_no_chances() -> None:
    assert condition_on_existence(np.zeros((2, 0)), np.zeros(2), np.zeros(0, np.int64)).shape == (2, 0)


class Sides:
    """An encoder that knows two kinds of names: those with an even and those with an odd number of letters."""

    name = "sides"

    def encode(self, names: list[str]) -> Floats32:
        return np.array([[1.0, 0.0] if len(n) % 2 else [0.0, 1.0] for n in names], dtype=np.float32)


def two_kinds(rng: np.random.Generator) -> PlacementCounts:
    """Twenty types: the even ones are found in the first of two containers nine times in ten, the odd ones seldom."""
    held, stood = np.zeros((20, 2, 3)), np.zeros((20, 2, 3))
    stood[:, 0, :2] = 100
    for item in range(20):
        first = rng.binomial(5, 0.9 if item % 2 == 0 else 0.1)
        held[item, 0, :2] = first, 5 - first
    return PlacementCounts(
        rooms=("Kitchen",),
        containers=("Bed", "Sofa"),
        items=tuple(f"{k:02}" for k in range(20)),
        held=held,
        stood=stood,
    )


def test_kinds_are_found_again_and_pull_what_was_seldom_met() -> None:
    found = two_kinds(np.random.default_rng(0))
    vectors = np.array([[1.0, 0.0], [0.0, 1.0]] * 10)
    kinds = fit_kinds(found, vectors, rng=np.random.default_rng(1), how=QUICK)
    share = kinds.rate[:, 0] / (kinds.rate[:, 0] + kinds.rate[:, 1])
    assert np.sort(share) == pytest.approx([0.1, 0.9], abs=0.1)
    once = np.zeros((1, 6))
    once[0, 0] = 1
    stood = found.stood[:1].reshape(1, -1)
    rates = rates_of(once, stood, np.array([[1.0, 0.0]]), kinds, QUICK)
    assert 0.8 < rates[0, 0] / (rates[0, 0] + rates[0, 1]) < 0.99
    never = rates_of(np.zeros((1, 6)), stood, np.array([[0.0, 1.0]]), kinds, QUICK)
    assert never[0, 1] > 4 * never[0, 0]


def test_what_was_often_met_keeps_its_own_places() -> None:
    found = two_kinds(np.random.default_rng(0))
    vectors = np.array([[1.0, 0.0], [0.0, 1.0]] * 10)
    kinds = fit_kinds(found, vectors, rng=np.random.default_rng(1), how=QUICK)
    often = np.zeros((1, 6))
    often[0, :2] = 3000, 7000
    stood = np.zeros((1, 6))
    stood[0, :2] = 20000
    rates = rates_of(often, stood, np.array([[1.0, 0.0]]), kinds, QUICK)
    assert rates[0, :2] == pytest.approx([0.15, 0.35], rel=0.02)


def test_rooms_that_have_a_thing_twice() -> None:
    """Mugs stand on both counters of every kitchen, forks on one of them: mugs may be twice in a room, forks not."""
    houses = [with_counters(learnable_house(k), forks_on=k % 2) for k in range(40)]
    found = tally(houses)
    stood = np.maximum(found.stood, 1.0)
    several = duplicate_probability(np.clip(found.held / stood, 0.0, 0.9), found, houses)
    at = {name: k for k, name in enumerate(found.items)}
    assert several[at["Mug"]] > 0.99
    assert several[at["Fork"]] < 0.01


def test_a_type_counts_as_absent_only_where_its_source_has_it_at_all() -> None:
    here, there = learnable_house(1), learnable_house(2)
    plain = [item for items in there.contents.values() for item in items if item.type != "Mug"]
    other = House(
        plan=_renamed(there, "other:0"),
        contents={c: tuple(i for i in items if i in plain) for c, items in there.contents.items()},
    )
    found = tally([here, other])
    at = {name: k for k, name in enumerate(found.items)}
    assert found.stood[at["Mug"]].sum() == len(here.plan.containers)
    assert found.stood[at["Fork"]].sum() == len(here.plan.containers) + len(other.plan.containers)


def test_the_same_seed_learns_the_same_and_an_unknown_name_goes_by_those_near_it() -> None:
    houses = [learnable_house(k) for k in range(12)]
    first, again = (placements_from(houses, Sides(), seed=3, how=QUICK) for _ in range(2))  # type: ignore[arg-type]
    assert first.rates.tobytes() == again.rates.tobytes()
    rates = first.rates_at(("Kitchen", "Bedroom", "Attic"), ("Fridge", "Desk", "Chest"), ("Mug", "Zonk"))
    assert rates.shape == (2, 3)
    assert (rates > 0).all()
    assert (rates < 1).all()
    assert first.occurrences(("Mug", "Zonk"))[1] == 0
    assert 0 < first.duplicate_probabilities(("Zonk",))[0] < 1


def with_counters(house: House, *, forks_on: int) -> House:
    contents: dict[ContainerId, tuple[Item, ...]] = dict.fromkeys(house.contents, ())
    for k in range(2):
        counter = ContainerId(f"CounterTop|{k + 1}")
        things = ["Mug", "Fork"] if k == forks_on else ["Mug"]
        contents[counter] = tuple(Item(id=ItemId(f"{t}|{k}"), type=ItemType(t)) for t in things)
    return House(plan=house.plan, contents=contents)


def _renamed(house: House, name: str) -> FloorPlan:
    return replace(house.plan, name=name)
