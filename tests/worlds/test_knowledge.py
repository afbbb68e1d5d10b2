"""The robot's knowledge, advanced by observations and actions; worked out on the toy house."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, item, toy_plan, toy_travel

from workbench.worlds.house import START, Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.travel import TravelCosts

MUG, EGG = item("Mug|1"), item("Egg|1")


def _start() -> Knowledge:
    return knowledge_at_start(toy_plan(), toy_travel(), {FRIDGE: (EGG,)})


def test_known_containers_are_not_unsearched_and_not_visited() -> None:
    knowledge = _start()
    assert knowledge.unsearched == (COUNTER, TABLE, BED, DESK)
    assert knowledge.visited == ()
    assert knowledge.where(EGG.type) == ((LocationId(FRIDGE), EGG),)


def test_what_is_known_at_the_start_is_as_seen_one_after_the_other() -> None:
    known = {TABLE: (MUG,), FRIDGE: (EGG, MUG), BED: ()}
    at_once, seen = (
        knowledge_at_start(toy_plan(), toy_travel(), known),
        knowledge_at_start(toy_plan(), toy_travel(), {}),
    )
    for container in sorted(known):
        seen = seen.seen(container, known[container], in_run=False)
    assert at_once == seen
    assert (at_once.unsearched, at_once.where(MUG.type)) == (seen.unsearched, seen.where(MUG.type))


def test_seeing_picking_carrying_and_placing() -> None:
    seen = _start().moved(LocationId(COUNTER)).seen(COUNTER, (MUG,))
    assert seen.visited == (COUNTER,)
    held = seen.picked(MUG)
    assert (held.holding, held.where(MUG.type), held.has_known_instance(MUG.type)) == (MUG, (), True)
    assert held.first_seen[COUNTER] == (MUG,), "what was first seen stays"
    down = held.moved(START).placed()
    assert (down.holding, down.where(MUG.type)) == (None, ((START, MUG),))
    assert seen.holding is None, "the old view is untouched"


def test_what_was_asked_before_is_not_told_of_other_contents() -> None:
    before = _start()
    assert (before.where(EGG.type), len(before.unsearched)) == (((LocationId(FRIDGE), EGG),), 4)
    elsewhere = replace(before, items_at=MappingProxyType({LocationId(BED): (EGG,)}))
    assert elsewhere.where(EGG.type) == ((LocationId(BED), EGG),)
    assert elsewhere.unsearched == before.unsearched
    assert replace(before, first_seen=MappingProxyType({})).unsearched == (FRIDGE, COUNTER, TABLE, BED, DESK)
    travel = toy_travel()
    fewer = TravelCosts(locations=travel.locations[:-1], metres=travel.metres[:-1, :-1], unreachable=(DESK,))
    assert replace(before, travel=fewer).unsearched == (COUNTER, TABLE, BED)
    assert before.moved(LocationId(BED)) == replace(before, robot_at=LocationId(BED))


@pytest.mark.parametrize("seed", range(20))
def test_whatever_was_asked_on_the_way_what_is_told_is_what_the_contents_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    things = [Item(id=ItemId(f"{t}|{i}"), type=ItemType(t)) for t in ("Egg", "Mug", "Pan") for i in range(3)]
    containers = (FRIDGE, COUNTER, TABLE, BED, DESK)
    knowledge = _start()
    for _ in range(40):
        place = containers[rng.integers(len(containers))]
        here = knowledge.items_at.get(knowledge.robot_at, ())
        some = tuple(things[i] for i in rng.choice(len(things), size=3, replace=False))
        match rng.integers(6):
            case 0:
                knowledge = knowledge.seen(place, some)
            case 1 if here and knowledge.holding is None:
                knowledge = knowledge.picked(here[rng.integers(len(here))])
            case 2:
                knowledge = knowledge.placed()
            case 3:
                knowledge = knowledge.without_item(things[rng.integers(len(things))].id)
            case 4 if rng.random() < 0.2:
                knowledge = knowledge.refuse_search(place)
            case _:
                knowledge = knowledge.moved(LocationId(place))
        asked = [thing.type for thing in things if rng.random() < 0.5]
        anew = replace(knowledge, items_at=dict(knowledge.items_at), first_seen=dict(knowledge.first_seen))
        assert [knowledge.where(t) for t in asked] == [anew.where(t) for t in asked]
        assert rng.random() < 0.5 or knowledge.unsearched == anew.unsearched


def test_a_shut_container_is_no_candidate_any_more() -> None:
    assert BED not in _start().refuse_search(BED).unsearched


def test_a_lost_item_is_nowhere() -> None:
    assert not _start().without_item(EGG.id).has_known_instance(EGG.type)


def test_a_container_that_cannot_be_reached_is_no_candidate() -> None:
    travel = toy_travel()
    fewer = TravelCosts(locations=travel.locations[:-1], metres=travel.metres[:-1, :-1], unreachable=(DESK,))
    assert DESK not in knowledge_at_start(toy_plan(), fewer, {}).unsearched


def test_nothing_is_known_of_a_type_never_seen() -> None:
    assert not _start().has_known_instance(ItemType("Mug"))


def test_putting_down_with_an_empty_hand_changes_nothing() -> None:
    assert _start().placed() == _start()


def test_views_cannot_be_written() -> None:
    with pytest.raises(TypeError):
        _start().items_at[START] = ()  # type: ignore[index]
