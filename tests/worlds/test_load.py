"""ProcTHOR houses become Houses: frames, doors, types, ids, and all 620 shared ones."""

from __future__ import annotations

import copy
import json
from collections import Counter
from math import cos, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from procthor_house import point, thing, two_rooms

from workbench.errors import BadValue, InputError, MalformedFile
from workbench.worlds.house import ContainerId, House
from workbench.worlds.maps.connectivity import RoomsNotConnected
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.names import type_of_asset
from workbench.worlds.procthor.load import house_from_json, load_house, load_houses, pose_from_unity
from workbench.worlds.procthor.schema import Vector


def changed(**parts: Any) -> dict[str, Any]:
    house = copy.deepcopy(two_rooms())
    house.update(parts)
    return house


def test_unity_frame_becomes_map_frame() -> None:
    """Map x is Unity x, map y is Unity z; Unity turns clockwise seen from above and faces z when not turned."""
    pose = pose_from_unity(Vector(x=1, y=0.9, z=2), Vector())
    assert pose.point == (1, 2)
    assert (cos(pose.yaw_rad), sin(pose.yaw_rad)) == pytest.approx((0, 1))
    east = pose_from_unity(Vector(), Vector(y=90))
    assert (cos(east.yaw_rad), sin(east.yaw_rad)) == pytest.approx((1, 0))
    assert pose_from_unity(Vector(), Vector(y=-270)).yaw_rad == pytest.approx(east.yaw_rad)


def test_the_house_by_hand() -> None:
    house = house_from_json(two_rooms(), name="hand")
    plan = house.plan
    assert [(c.id, c.type, c.room) for c in plan.containers] == [
        ("Fridge|2|0", "Fridge", "room|2"),
        ("Bed|3|0", "Bed", "room|3"),
    ]
    assert [i.type for i in house.contents[ContainerId("Fridge|2|0")]] == ["Egg"]
    assert [f.type for f in plan.furniture] == ["HousePlant"]
    assert plan.start.point == (2, 2)
    assert plan.start.yaw_rad == pytest.approx(0)


def test_sizes_are_depth_width_height_and_stay_in_the_room() -> None:
    house = house_from_json(two_rooms(), name="hand")
    fridge = house.plan.container(ContainerId("Fridge|2|0"))
    assert fridge.size_m[0] == pytest.approx(min(0.8, fridge.size_m[0]))
    assert fridge.size_m[0] <= 2 * 0.4 + 1e-9  # its middle is 0.4 m from the wall behind it
    assert fridge.size_m[2] == pytest.approx(1.8)  # twice its middle's height
    assert fridge.base_m == pytest.approx(0)
    assert fridge.pose.yaw_rad == pytest.approx(-pi / 2)  # turned to face map -y


def test_door_hole_is_measured_along_its_wall_and_front_doors_are_shut() -> None:
    plan = house_from_json(two_rooms(), name="hand").plan
    inner, front = plan.doors
    assert (inner.start, inner.end, inner.passable) == ((4, 1.5), (4, 2.5), True)
    assert inner.rooms == ("room|2", "room|3")
    assert (front.start, front.end, front.passable) == ((1, 0), (2, 0), False)


def test_a_hole_may_be_a_bounding_box() -> None:
    """As the first release of ProcTHOR-10K has it, with walls whose corners go round."""
    data = two_rooms()
    for door in data["doors"]:
        low, high = door.pop("holePolygon")
        door["boundingBox"] = {"min": low, "max": high}
    for record in data["walls"]:
        a, b, above_a, above_b = record["polygon"]
        record["polygon"] = [a, above_a, above_b, b]
    assert house_from_json(data, name="hand").plan.doors == house_from_json(two_rooms(), name="hand").plan.doors


def test_walls_lose_their_twins() -> None:
    plan = house_from_json(two_rooms(), name="hand").plan
    assert len(plan.walls) == 7
    assert {w.room for w in plan.walls} == {"room|2", "room|3"}


@pytest.mark.parametrize("mark", [{"empty": True}, {"material": {"name": "Empty"}}, {"material": "empty"}])
def test_an_empty_wall_joins_rooms(mark: dict[str, Any]) -> None:
    data = changed(doors=[])
    with pytest.raises(RoomsNotConnected, match="1 of 2 rooms"):
        house_from_json(data, name="hand")
    for record in data["walls"]:
        if record["id"] == "wall|3|middle":
            record.update(mark)
    plan = house_from_json(data, name="hand").plan
    assert [w.empty for w in plan.walls].count(True) == 1
    assert not navigate(plan).travel.unreachable


def test_older_ids_get_their_type_from_the_asset_name() -> None:
    stand = thing("2|0|0", "", (1, 0.35, 2), children=[thing("small|2|4", "", (1, 1, 2))])
    stand.pop("objectType")
    stand["assetId"] = "TV_Stand_212_1"
    stand["children"][0].pop("objectType")
    stand["children"][0]["assetId"] = "Television_13"
    house = house_from_json(changed(objects=[stand]), name="hand")
    assert [(c.id, c.type) for c in house.plan.containers] == [("TVStand|2|0|0", "TVStand")]
    assert [(i.id, i.type) for i in house.contents[ContainerId("TVStand|2|0|0")]] == [
        ("Television|2|4", "Television")
    ]


def test_a_thing_with_children_is_a_container_whatever_its_type() -> None:
    plant = thing(
        "HousePlant|3|2", "HousePlant", (5, 0.3, 1), children=[thing("KeyChain|3|3", "KeyChain", (5, 1, 1))]
    )
    house = house_from_json(changed(objects=[plant]), name="hand")
    assert [c.type for c in house.plan.containers] == ["HousePlant"]


def test_two_things_of_one_id_are_told_apart() -> None:
    house = house_from_json(changed(objects=[thing("Bed|3|0", "Bed", (7, 0.45, 3))] * 2), name="hand")
    assert [c.id for c in house.plan.containers] == ["Bed|3|0", "Bed|3|0#2"]


def test_odd_names_survive() -> None:
    name = "冷蔵庫 \"a\" 'b' [c] (d)|2|0"
    house = house_from_json(changed(objects=[thing(name, "Fridge", (1, 0.9, 3.6))]), name="Haus „Ä“ [1]")
    assert house.plan.name == "Haus „Ä“ [1]"
    assert house.plan.containers[0].id == "Fridge|2|0"
    kind = changed(
        objects=[thing("x", 'Schöner "Schrank" [1]', (1, 0.9, 3.6), children=[thing("y", "卵", (1, 1, 1))])]
    )
    house = house_from_json(kind, name="hand")
    assert house.item_types() == ("卵",)
    assert house.plan.containers[0].type == 'Schöner "Schrank" [1]'


def bad_coordinate(value: float) -> list[dict[str, Any]]:
    return [thing("Bed|3|0", "Bed", (value, 0.45, 3))]


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"rooms": []}, "at least one room"),
        ({"objects": bad_coordinate(float("nan"))}, "Bed.3.0"),
        ({"objects": bad_coordinate(1e9)}, "Bed.3.0"),
        ({"objects": [thing("Bed|3|0", "Bed", (7, float("inf"), 3))]}, "Bed.3.0"),
        ({"walls": []}, "wall0 of door"),
        ({"doors": [{"id": "door|2|3", "wall0": "wall|2|middle"}]}, "holePolygon of door"),
        ({"rooms": [{"id": "a", "roomType": "Kitchen", "floorPolygon": [point(0, 0, 0)]}]}, "floor of room a"),
        ({"metadata": {"agent": {"position": point(float("nan"), 0, 0)}}}, "metadata.agent"),
        ({"rooms": two_rooms()["rooms"] * 2}, "room ids"),
    ],
)
def test_bad_houses_are_refused_in_one_line(parts: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says) as refused:
        house_from_json(changed(**parts), name="hand")
    assert "\n" not in str(refused.value)


def test_a_house_without_an_agent_starts_in_its_largest_room() -> None:
    plan = house_from_json(changed(metadata=None), name="hand").plan
    assert plan.start.point == (2, 2)


@pytest.mark.parametrize("data", [17, [], {"rooms": 3}, {"rooms": [], "walls": "no"}, None])
def test_json_that_is_no_house(data: object) -> None:
    with pytest.raises(MalformedFile, match="no ProcTHOR house"):
        house_from_json(data, name="hand")


def test_a_house_of_kilometres_is_refused_before_it_is_allocated() -> None:
    data = json.loads(json.dumps(two_rooms()))
    for record in data["rooms"]:
        for corner in record["floorPolygon"]:
            corner["x"] *= 1000
            corner["z"] *= 1000
    house = house_from_json(data, name="hand")
    with pytest.raises(BadValue, match="check the units"):
        navigate(house.plan)


@pytest.fixture(scope="module")
def all_houses(procthor: Path) -> dict[str, list[House]]:
    return {name: load_houses(procthor / f"{name}.jsonl.gz") for name in ("multi_room_train", "single_room_train")}


@pytest.mark.slow
def test_all_shared_houses_load_and_their_containers_can_be_reached(all_houses: dict[str, list[House]]) -> None:
    houses = [house for group in all_houses.values() for house in group]
    assert len(houses) == 620
    unreachable = sum(len(navigate(house.plan).travel.unreachable) for house in houses)
    containers = sum(len(house.plan.containers) for house in houses)
    assert 1 - unreachable / containers >= 0.99
    assert not [f for house in houses for f in house.plan.furniture if f.type == "ObjaUnknown"]


def test_addresses_name_houses(all_houses: dict[str, list[House]], procthor: Path) -> None:
    house = load_house(f"{procthor / 'multi_room_train.jsonl.gz'}:17")
    assert house == all_houses["multi_room_train"][17]
    assert house.plan.name == "multi_room_train:17"


def test_types_agree_with_the_asset_table(procthor: Path) -> None:
    import csv

    with (procthor / "asset_sizes.csv").open() as lines:
        rows = list(csv.DictReader(lines))
    fixed = {"Doorway", "Doorframe", "Window", "Blinds"}  # parts of the building, never objects
    wrong = [r for r in rows if r["object_type"] not in fixed and type_of_asset(r["asset_id"]) != r["object_type"]]
    assert wrong == []
    assert len(rows) > 1600


def test_with_the_asset_table_only_sizes_change(all_houses: dict[str, list[House]], procthor: Path) -> None:
    """Usual sizes, cut to the room, are 5 cm off in the median, heights not at all; travel is 1 % longer."""
    exact = load_houses(procthor / "multi_room_train.jsonl.gz", assets=procthor / "asset_sizes.csv")
    usual = all_houses["multi_room_train"]
    assert [h.contents for h in exact] == [h.contents for h in usual]
    pairs = [
        (a.size_m, b.size_m)
        for h, g in zip(exact, usual, strict=True)
        for a, b in zip(h.plan.containers, g.plan.containers, strict=True)
    ]
    gaps = np.abs(np.array([a for a, _ in pairs]) - np.array([b for _, b in pairs]))
    assert (np.median(gaps, axis=0) < (0.06, 0.06, 0.001)).all()
    ratios = []
    for h, g in zip(exact[:60], usual[:60], strict=True):
        a, b = navigate(h.plan).travel, navigate(g.plan).travel
        if a.locations == b.locations and len(a.locations) > 3:
            ratios.append(b.metres.mean() / a.metres.mean())
    assert 0.98 < np.mean(ratios) < 1.03


def test_rooms_by_place_agree_with_rooms_by_id(all_houses: dict[str, list[House]]) -> None:
    agree = Counter(
        container.id.split("|")[1] == container.room.split("|")[1]
        for houses in all_houses.values()
        for house in houses
        for container in house.plan.containers
    )
    assert agree[False] == 0


def test_beds_and_sofas_turn_their_back_to_the_wall(all_houses: dict[str, list[House]]) -> None:
    """Their yaw is where their front is: one step ahead is further inside the room than one step back."""
    from workbench.worlds.maps.connectivity import inside

    ahead = back = 0
    for house in all_houses["multi_room_train"]:
        floors = {room.id: room.floor for room in house.plan.rooms}
        for c in house.plan.containers:
            if c.type in ("Sofa", "Fridge", "Dresser"):
                c_x, c_y = cos(c.pose.yaw_rad), sin(c.pose.yaw_rad)
                ahead += inside((c.pose.x_m + c_x, c.pose.y_m + c_y), floors[c.room])
                back += inside((c.pose.x_m - c_x, c.pose.y_m - c_y), floors[c.room])
    assert ahead > 3 * back
