"""The vocabulary: readable names, sizes, which types are containers and which can be carried."""

from __future__ import annotations

import pytest

from workbench.errors import UnknownName
from workbench.worlds.names import (
    UNKNOWN_SIZE_M,
    can_carry,
    generic_type,
    is_container,
    readable_name,
    size_of_asset_m,
    type_named,
    type_of_asset,
    usual_size_m,
    vocabulary,
)


@pytest.mark.parametrize(
    ("type_name", "name"),
    [
        ("ShelvingUnit", "shelving unit"),
        ("TVStand", "TV stand"),
        ("ObjaWallClock", "wall clock"),
        ("ObjaGps", "gps"),
        ("ObjaCellphone", "cell phone"),
        ("GarbageCan", "garbage can"),
        ("SomethingNew", "something new"),
    ],
)
def test_readable_names(type_name: str, name: str) -> None:
    assert readable_name(type_name) == name


@pytest.mark.parametrize(
    ("asset", "type_name"),
    [
        ("TV_Stand_212_1", "TVStand"),
        ("bin_18", "GarbageCan"),
        ("RoboTHOR_garbage_bin_ai2_1_v", "GarbageCan"),
        ("Desk_Lamp_3", "DeskLamp"),
        ("Desk_204_1", "Desk"),
        ("Pen_1", "Pen"),
        ("Pencil_1", "Pencil"),
        ("Countertop_L_8x6", "CounterTop"),
        ("abb34c0ea83b43c58232bcd07793d979", None),
        ("", None),
    ],
)
def test_types_from_asset_names(asset: str, type_name: str | None) -> None:
    assert type_of_asset(asset) == type_name


def test_a_countertop_says_its_size_in_feet() -> None:
    size = size_of_asset_m("Countertop_L_8x6")
    assert size is not None
    assert size[:2] == pytest.approx((6 * 0.3048, 8 * 0.3048))
    assert size_of_asset_m("Bed_1") is None


def test_what_holds_and_what_can_be_carried() -> None:
    assert is_container("Fridge")
    assert is_container("Chair")
    assert not is_container("HousePlant")
    assert not is_container("ObjaBed")
    assert can_carry("Mug")
    assert can_carry("ObjaHairbrush")
    assert not can_carry("Faucet")
    assert not can_carry("Fridge")


def test_sizes() -> None:
    depth, width, height = usual_size_m("Bed")
    assert depth > width > height
    assert usual_size_m("ObjaNothingKnown") == UNKNOWN_SIZE_M
    assert all(0 < side < 4 for word in vocabulary().values() for side in word.size_m)


def test_people_name_types_as_they_like() -> None:
    known = ["CellPhone", "Mug", "ObjaMug", "RemoteControl"]
    for name in ("CellPhone", "cellphone", "cell phone", "cell-phone", "Cell Phone"):
        assert type_named(name, known) == "CellPhone"
    assert type_named("mug", known) == "Mug"
    assert type_named("ObjaMug", known) == "ObjaMug"
    with pytest.raises(UnknownName, match=r"Did you mean:? mug"):
        type_named("mugg", known)


def test_every_kind_of_furniture_has_a_name_and_no_two_rows_share_one() -> None:
    names = [word.name for word in vocabulary().values()]
    assert len(set(names)) == len(names)
    assert generic_type("ObjaEgg") == "Egg"
    assert generic_type("ObjaHairbrush") == "Hairbrush"
