"""The reach of rooms in a house of two: by a door, by an open wall, and behind furniture."""

from __future__ import annotations

from typing import Any

import pytest
from procthor_house import thing, two_rooms

from workbench.worlds.house import Container, FloorPlan
from workbench.worlds.maps.navigation import compute
from workbench.worlds.maps.reach import RoomAccess, RoomReach, rooms_reached
from workbench.worlds.procthor.load import house_from_json


def reach_of(record: dict[str, Any], *blocks: Container) -> dict[str, RoomReach]:
    plan = house_from_json(record, name="two").plan
    containers = (*plan.containers, *blocks)
    plan = FloorPlan(
        name=plan.name,
        rooms=plan.rooms,
        walls=plan.walls,
        doors=plan.doors,
        windows=plan.windows,
        containers=containers,
        furniture=plan.furniture,
        start=plan.start,
    )
    reached = rooms_reached(plan, compute(plan, resolution_m=0.1, robot_radius_m=0.2))
    return {reach.room: reach for reach in reached}


def shelf(x_m: float, y_m: float, wide_m: float, deep_m: float) -> Container:
    plan = house_from_json(two_rooms(), name="two").plan
    of = plan.containers[0]
    pose = type(of.pose)(x_m=x_m, y_m=y_m)
    return Container(id=type(of.id)("Shelf|9"), type="Shelf", room=of.room, pose=pose, size_m=(wide_m, deep_m, 1.0))


def test_rooms_joined_by_a_door() -> None:
    reached = reach_of(two_rooms())
    kitchen, bedroom = reached["room|2"], reached["room|3"]
    assert kitchen.joined == (("room|3", "door"),)
    assert bedroom.joined == (("room|2", "door"),)
    assert 5 < kitchen.free_m2 < 16
    assert not kitchen.cut_off
    assert (kitchen.access.kind, bedroom.unreachable) == (RoomAccess.WHOLE, ())


def test_rooms_joined_by_an_open_wall_and_no_door() -> None:
    record = two_rooms()
    record["doors"] = [door for door in record["doors"] if door["id"] != "door|2|3"]
    for wall in record["walls"]:
        if wall["id"].endswith("middle"):
            wall["material"] = {"name": "empty"}
    reached = reach_of(record)
    assert reached["room|2"].joined == (("room|3", "open wall"),)
    assert not reached["room|3"].cut_off


@pytest.mark.parametrize(
    ("gap_m", "why"),
    [
        (0.0, "furniture or walls leave no way in"),
        (0.3, "the way is narrower than the robot, 0.4 m"),
    ],
)
def test_a_room_behind_furniture_is_cut_off_and_says_by_what(gap_m: float, why: str) -> None:
    """A shelf across the kitchen, a metre before the door, with a gap beside the wall."""
    across = shelf(2.8, (gap_m + 4) / 2, 0.3, 4 - gap_m)
    cut = [reach for reach in reach_of(two_rooms(), across).values() if reach.cut_off]
    assert [(reach.room, reach.access.message) for reach in cut] == [("room|2", why)]
    assert cut[0].unreachable


def test_a_container_without_free_floor_beside_it_says_so() -> None:
    record = two_rooms()
    record["objects"].append(thing("Box|2|9", "Box", (0.3, 0.5, 0.3)))
    wall_of_shelves = shelf(0.0, 1.0, 3.2, 1.2)
    reached = reach_of(record, wall_of_shelves)
    for reach in reached.values():
        assert bool(reach.unreachable) == ("no free floor" in reach.access.message)
