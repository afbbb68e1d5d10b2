"""Ways on which containers come into view: the order, where a robot stops, and the travel costs from there."""

from __future__ import annotations

from math import dist, hypot

import numpy as np
import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, toy_house
from world_contract import check_world

from workbench.errors import BadValue
from workbench.log_schema.place import Place, place_from_json, place_to_json
from workbench.worlds.house import START, ItemId, ItemType, LocationId
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.sight.sightings import SightPaths, UnknownSight, Walk, sight_paths, stop_point
from workbench.worlds.simulated import SimulatedWorld, is_missed
from workbench.worlds.world import ActionDone, ActionRefused, LookResult

MUG, PILLOW = ItemType("Mug"), ItemType("Pillow")
HOUSE = toy_house()
NAVIGATION = navigate(HOUSE.plan)


def ways(radius_m: float = 2.5) -> SightPaths:
    return SightPaths(HOUSE.plan, NAVIGATION.travel, NAVIGATION, radius_m)


def test_by_hand_the_start_sees_the_kitchen_and_not_the_bedroom() -> None:
    """Counter (2.0, 3.6) and table (2.0, 0.8) are 1.9 and 1.6 m from the start (1.0, 2.0); the fridge is closed."""
    assert [s.container for s in ways().at_start()] == [COUNTER, TABLE]
    assert ways(1.7).at_start()[0].container == TABLE
    assert ways(0.1).at_start() == ()
    assert FRIDGE not in ways().open


def test_what_is_passed_comes_in_order_and_within_the_radius() -> None:
    seen = ways().along(START, LocationId(BED))
    assert [s.container for s in seen] == [COUNTER, TABLE, BED, DESK]
    assert [s.along_m for s in seen] == sorted(s.along_m for s in seen)
    for sighting in seen:
        centre = HOUSE.plan.container(sighting.container).pose.point
        assert dist(sighting.viewpoint.point, centre) <= 2.5 + 1e-9
    assert seen == ways().along(START, LocationId(BED))


def test_a_robot_that_goes_to_look_stops_where_it_sees_the_container_or_what_it_seeks() -> None:
    def walk(seeking: tuple[ItemType, ...] | None) -> Walk:
        made = ways().walk(
            START, LocationId(DESK), seeking=seeking, known={COUNTER, TABLE}, shows=lambda c: HOUSE.contents[c]
        )
        assert isinstance(made, Walk)
        return made

    whole = walk(None)
    assert whole.end == LocationId(DESK)
    assert whole.metres == NAVIGATION.travel.between(START, LocationId(DESK))
    assert [s.container for s, _ in whole.seen] == [BED, DESK]
    bed_m, desk_m = (s.along_m for s, _ in whole.seen)
    assert bed_m < desk_m
    assert walk((PILLOW,)).metres == bed_m
    assert [s.container for s, _ in walk((PILLOW,)).seen] == [BED]
    assert walk((MUG,)).metres == walk(()).metres == desk_m
    stopped = walk(())
    assert stop_point(stopped.end) == pytest.approx(stopped.path[-1], abs=1e-3)
    length = sum(hypot(b[0] - a[0], b[1] - a[1]) for a, b in zip(stopped.path, stopped.path[1:], strict=False))
    assert length == pytest.approx(stopped.metres)


def test_costs_from_a_stop_are_those_of_the_grid() -> None:
    """On from a stop to the same goal: as long as the way left; no way is shorter than by the triangle inequality."""
    made = ways()
    walk = made.walk(START, LocationId(DESK), seeking=(), known=(), shows=lambda c: ())
    assert isinstance(walk, Walk)
    travel = made.travel_from(walk.end)
    assert travel.between(walk.end, LocationId(DESK)) is not None
    base = NAVIGATION.travel
    row = travel.metres[travel.index(walk.end), :-1]
    assert row[base.index(START)] == pytest.approx(walk.metres)
    assert row[base.index(START)] + row[base.index(LocationId(DESK))] == pytest.approx(
        base.between(START, LocationId(DESK))
    )
    assert (np.abs(row[:, None] - row[None, :]) <= base.metres + 1e-9).all()
    onwards = made.path(walk.end, LocationId(DESK))
    assert onwards is not None
    assert onwards[-1] == NAVIGATION.standing[LocationId(DESK)].point


def test_what_lies_ahead_of_a_stop_does_not_depend_on_who_walked_there_before() -> None:
    made = ways()
    walk = made.walk(START, LocationId(DESK), seeking=(), known=(), shows=lambda c: ())
    assert isinstance(walk, Walk)
    fresh, bed = ways(), LocationId(BED)
    assert made.standing_pose(walk.end) == fresh.standing_pose(walk.end)
    assert made.path(walk.end, bed) == fresh.path(walk.end, bed)
    assert made.along(walk.end, bed) == fresh.along(walk.end, bed)


def test_an_unknown_sight_ends_the_answer() -> None:
    found = ways().walk(START, LocationId(BED), seeking=None, known={COUNTER}, shows=lambda c: None)
    assert found == UnknownSight(container=TABLE)
    assert ways().walk(START, LocationId("Oven"), seeking=None, known=(), shows=lambda c: ()) is None


def test_a_logged_place_gives_the_same_ways() -> None:
    place = place_from_json(place_to_json(Place.of(HOUSE.plan, NAVIGATION)))
    logged = sight_paths(place.plan, place.travel, place.paths(), 2.5)
    assert logged is not None
    for a in NAVIGATION.travel.locations:
        for b in NAVIGATION.travel.locations:
            assert logged.along(a, b) == ways().along(a, b)
    one, other = (w.walk(START, LocationId(DESK), seeking=(), known=(), shows=lambda c: ()) for w in (logged, ways()))
    assert one == other
    assert isinstance(one, Walk)
    assert logged.travel_from(one.end) == SightPaths(HOUSE.plan, NAVIGATION.travel, NAVIGATION, 2.5).travel_from(
        one.end
    )


def test_no_radius_sees_nothing_and_others_are_refused() -> None:
    assert sight_paths(HOUSE.plan, NAVIGATION.travel, NAVIGATION, 0.0) is None
    with pytest.raises(BadValue, match="sight radius"):
        sight_paths(HOUSE.plan, NAVIGATION.travel, NAVIGATION, -1.0)


@pytest.mark.parametrize("name", ["start", "Bed|2|1", "on the way|1", "on the way|a|2", "on the way|nan|1"])
def test_other_names_are_no_stops(name: str) -> None:
    assert stop_point(name) is None


def test_a_simulated_world_that_sees_is_a_world() -> None:
    check_world(SimulatedWorld(HOUSE, NAVIGATION, passing=ways()))


def test_a_simulated_robot_stops_and_can_put_nothing_down_there() -> None:
    world = SimulatedWorld(HOUSE, NAVIGATION, passing=ways())
    assert set(world.known_at_start()) == set(world.seen_at_start()) == {COUNTER, TABLE}
    world.go_to(LocationId(FRIDGE))
    world.pick(ItemId("Egg|1"))
    gone = world.go_to(LocationId(DESK), seeking=(MUG,))
    assert isinstance(gone, ActionDone)
    assert [s.container for s in gone.seen] == [BED, DESK]
    assert gone.start_ns < gone.seen[0].stamp_ns < gone.seen[1].stamp_ns <= gone.end_ns
    assert gone.ended_at is not None
    assert stop_point(gone.ended_at) is not None
    refused = world.place(ItemId("Egg|1"))
    assert isinstance(refused, ActionRefused)
    assert "nothing to put" in refused.reason
    on = world.go_to(LocationId(DESK))
    assert isinstance(on, ActionDone)
    assert on.seen == ()
    assert gone.travel_m + on.travel_m == pytest.approx(
        NAVIGATION.travel.between(LocationId(FRIDGE), LocationId(DESK))
    )


def test_what_is_passed_is_a_look_that_can_miss_and_the_view_from_the_start_is_not() -> None:
    """The draws are those of numbered looks: a look after passing is the second one, with a draw of its own."""
    missed_first = 0
    for seed in range(20):
        world = SimulatedWorld(HOUSE, NAVIGATION, passing=ways(), miss_rate=0.5, seed=seed)
        assert world.known_at_start() == {c: HOUSE.contents[c] for c in (COUNTER, TABLE)}
        gone = world.go_to(LocationId(DESK))
        assert isinstance(gone, ActionDone)
        passed = {seen.container: seen.items for seen in gone.seen}
        looked = world.look_into(DESK)
        assert isinstance(looked, LookResult)
        for shown, number in ((passed[DESK], 0), (looked.items, 1)):
            there = HOUSE.contents[DESK]
            missed = {i.id for i in there if is_missed(i.id, DESK, look=number, rate=0.5, seed=seed)}
            assert {i.id for i in shown} == {i.id for i in there} - missed
        missed_first += len(passed[DESK]) < len(looked.items)
    assert missed_first
