"""Place, task, settings and identity survive the round trip through attachments; invalid ones are refused."""

from __future__ import annotations

import json

import numpy as np
import pytest
from sample_logs import toy_info, toy_place, toy_task
from toy import BED, COUNTER, TABLE, toy_house, toy_plan

from workbench.errors import LiosError
from workbench.log_schema.place import (
    MalformedPlace,
    Place,
    place_from_json,
    place_to_json,
    task_from_json,
    task_to_json,
)
from workbench.log_schema.run_info import MalformedInfo, NewerSchema, info_from_metadata, info_to_metadata
from workbench.log_schema.settings_json import settings_from_json, settings_to_json
from workbench.log_schema.task_json import MalformedTask
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Task
from workbench.search.costs import ActionCosts
from workbench.worlds.house import START, ItemType, LocationId
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.simulated import SimulatedWorld


def test_a_place_comes_back_with_every_digit_of_its_travel_costs():
    place = toy_place()
    again = place_from_json(place_to_json(place))
    assert again.plan == place.plan
    assert (again.travel.metres == place.travel.metres).all()
    assert again.travel.locations == place.travel.locations
    assert dict(again.standing) == dict(place.standing)
    assert again.occupancy is not None
    assert place.occupancy is not None
    assert (again.occupancy.occupied == place.occupancy.occupied).all()
    assert again.occupancy.origin == place.occupancy.origin
    assert place_to_json(place_from_json(place_to_json(again))) == place_to_json(again)


def test_travel_costs_that_differ_by_direction_come_back_too():
    place = toy_place()
    metres = np.array(place.travel.metres)
    metres[1, 2] = 1.25
    one_way = Place(plan=place.plan, travel=type(place.travel)(locations=place.travel.locations, metres=metres))
    assert (place_from_json(place_to_json(one_way)).travel.metres == metres).all()


def test_a_place_walks_the_same_ways_as_the_world_that_it_was_taken_from():
    navigation = navigate(toy_plan())
    world = SimulatedWorld(toy_house(), navigation)
    place = Place.of(world.plan, world.paths, travel=world.travel)
    ways = place_from_json(place_to_json(place)).paths()
    for a in navigation.travel.locations:
        for b in navigation.travel.locations:
            assert ways.path(a, b) == navigation.path(a, b)
        assert ways.standing_pose(a) == navigation.standing_pose(a)


def test_a_place_without_a_grid_walks_straight_and_refuses_the_unknown():
    place = toy_place()
    bare = Place(plan=place.plan, travel=place.travel, standing=place.standing)
    assert bare.paths().path(START, LocationId(TABLE)) == ((1.0, 2.0), (4.0, 2.0))
    assert bare.paths().path(START, LocationId("nowhere")) is None


@pytest.mark.parametrize(
    "damage",
    [
        lambda d: d.pop("plan"),
        lambda d: d["plan"].update(rooms=[]),
        lambda d: d["travel"].update(metres=[[0]]),
        lambda d: d["travel"]["metres"][1].__setitem__(0, -1),
        lambda d: d["travel"]["metres"].__setitem__(1, [0, 0, 0, 0, 0, 0, 0, 0]),
        lambda d: d["occupancy"].update(rows=10**9),
        lambda d: d["occupancy"].update(rows=3),
        lambda d: d["occupancy"].update(bits="%%%"),
        lambda d: d["occupancy"].update(bits="AAAA"),
        lambda d: d.update(version=99),
    ],
)
def test_a_place_that_cannot_be_is_refused(damage):
    data = json.loads(place_to_json(toy_place()))
    damage(data)
    with pytest.raises(LiosError):
        place_from_json(json.dumps(data))


def test_a_small_file_cannot_unpack_to_a_huge_grid():
    import base64
    import zlib

    data = json.loads(place_to_json(toy_place()))
    data["occupancy"]["bits"] = base64.b64encode(zlib.compress(bytes(50_000_000))).decode()
    with pytest.raises(MalformedPlace, match="cells"):
        place_from_json(json.dumps(data))


def test_tasks_of_every_kind_of_goal_come_back():
    mug = Delivered(item_type=ItemType("Mug"), at=LocationId(TABLE), properties=("filled",))
    egg = Delivered(item_type=ItemType("Egg"), at=LocationId(BED))
    goal = AllOf(parts=(mug, AnyOf(parts=(egg, AllOf(parts=(mug,))))))
    task = Task(scenario="my own", goal=goal, failure_cost=1.5, budget_s=3.0, title="'\"<ünï>", available=())
    assert task_from_json(task_to_json(task)) == task
    assert task_from_json(task_to_json(toy_task())) == toy_task()


@pytest.mark.parametrize("text", ["", "{}", '{"scenario": "x", "goal": {"goal": "eat"}}', "[" * 10_000])
def test_what_is_no_task_is_refused(text: str):
    with pytest.raises(MalformedTask):
        task_from_json(text)


def test_settings_come_back():
    settings = settings_from_json(settings_to_json(ActionCosts(search=1.0), {"limit": 8}))
    assert settings.costs == ActionCosts(search=1.0)
    assert settings.more == {"limit": 8}


def test_identity_comes_back_and_ignores_what_later_releases_add():
    info = toy_info(code_dirty=True, title="naïve 'quoted' [brackets]")
    pairs = info_to_metadata(info)
    assert all(isinstance(value, str) for value in pairs.values())
    assert info_from_metadata({**pairs, "weather": "fine"}) == info


def test_a_log_of_a_newer_version_says_so():
    pairs = info_to_metadata(toy_info(schema_version=99))
    with pytest.raises(NewerSchema, match="version 99"):
        info_from_metadata(pairs)


@pytest.mark.parametrize("broken", [{"seed": "many"}, {"started": "noon"}, {"schema_version": ""}])
def test_identity_that_makes_no_sense_is_refused(broken: dict[str, str]):
    with pytest.raises(MalformedInfo):
        info_from_metadata({**info_to_metadata(toy_info()), **broken})


def test_names_of_containers_survive():
    assert COUNTER in {c.id for c in place_from_json(place_to_json(toy_place())).plan.containers}
