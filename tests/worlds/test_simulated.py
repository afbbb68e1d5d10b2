"""The simulated world answers from the truth, on a clock of its own."""

from __future__ import annotations

import pytest
from toy import BED, COUNTER, FRIDGE, TABLE, item, toy_house
from world_contract import check_world

from workbench.errors import UnknownName
from workbench.worlds.house import START, ContainerId, ItemId, LocationId
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.simulated import EPOCH_NS, SimulatedWorld
from workbench.worlds.world import ActionDone, ActionRefused, LookResult


def world(*known: ContainerId) -> SimulatedWorld:
    house = toy_house()
    return SimulatedWorld(house, navigate(house.plan), known=known)


def test_it_is_a_world() -> None:
    check_world(world())


def test_the_clock_moves_by_acting_only() -> None:
    """1 s a metre, 2 s a look, 5 s a manipulation, from the fixed epoch."""
    w = world()
    assert w.now_ns() == EPOCH_NS == 1767225600 * 10**9
    gone = w.go_to(LocationId(FRIDGE))
    assert isinstance(gone, ActionDone)
    assert gone.end_ns - gone.start_ns == round(gone.travel_m * 1e9)
    looked = w.look_into(FRIDGE)
    assert isinstance(looked, LookResult)
    assert looked.end_ns - looked.start_ns == 2 * 10**9
    picked = w.pick(ItemId("Egg|1"))
    assert isinstance(picked, ActionDone)
    assert picked.end_ns - picked.start_ns == 5 * 10**9
    assert w.now_ns() == picked.end_ns


def test_what_is_refused_takes_no_time_and_says_why() -> None:
    w = world()
    for answer, why in (
        (w.look_into(FRIDGE), "stands at start"),
        (w.look_into(ContainerId("Oven")), "no container Oven"),
        (w.pick(ItemId("Egg|1")), "no Egg|1 at start"),
        (w.place(ItemId("Egg|1")), "does not hold"),
        (w.go_to(LocationId("Oven")), "no way"),
    ):
        assert isinstance(answer, ActionRefused)
        assert why in answer.reason
    assert w.now_ns() == EPOCH_NS


def test_items_move_with_the_robot() -> None:
    w = world()
    w.go_to(LocationId(FRIDGE))
    w.pick(ItemId("Egg|1"))
    w.go_to(LocationId(BED))
    w.place(ItemId("Egg|1"))
    looked = w.look_into(BED)
    assert isinstance(looked, LookResult)
    assert item("Egg|1") in looked.items
    w.go_to(LocationId(FRIDGE))
    left = w.look_into(FRIDGE)
    assert isinstance(left, LookResult)
    assert item("Egg|1") not in left.items
    assert toy_house().contents[FRIDGE][0] == item("Egg|1")


def test_things_can_be_put_down_at_the_start() -> None:
    w = world()
    w.go_to(LocationId(FRIDGE))
    w.pick(ItemId("Egg|1"))
    w.go_to(START)
    assert isinstance(w.place(ItemId("Egg|1")), ActionDone)
    assert isinstance(w.pick(ItemId("Egg|1")), ActionDone)


def test_preparing_needs_everything_at_hand() -> None:
    w = world()
    w.go_to(LocationId(FRIDGE))
    w.pick(ItemId("Egg|1"))
    refused = w.prepare("boil", (ItemId("Egg|1"), ItemId("Pot|1")))
    assert isinstance(refused, ActionRefused)
    assert "Pot|1" in refused.reason
    w.go_to(LocationId(COUNTER))
    assert isinstance(w.prepare("boil", (ItemId("Egg|1"), ItemId("Pot|1"))), ActionDone)


def test_known_containers() -> None:
    assert world(TABLE, FRIDGE, TABLE).known_at_start() == {
        TABLE: toy_house().contents[TABLE],
        FRIDGE: toy_house().contents[FRIDGE],
    }
    with pytest.raises(UnknownName, match="Oven"):
        world(ContainerId("Oven"))


def test_the_same_actions_give_the_same_stamps() -> None:
    def play() -> list[object]:
        w = world()
        return [w.go_to(LocationId(BED)), w.look_into(BED), w.go_to(START)]

    assert play() == play()
