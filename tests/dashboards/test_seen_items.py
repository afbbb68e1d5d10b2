"""Items of the toy run: seen from a look on, in the hand after a pick, where they were put after a place."""

from __future__ import annotations

from dataclasses import replace

from toy import BED, COUNTER, FRIDGE, TABLE, toy_plan
from toy_run import action, ns, toy_run

from dashboards.model.containers.seen_items import items_seen
from dashboards.model.timeline import Timeline, timeline_of

INDEX = {c.id: i for i, c in enumerate(toy_plan().containers)}


def _at(timeline: Timeline, second: float) -> dict[str, int]:
    return {p.item: p.container for p in items_seen(timeline, ns(second))}


def test_items_are_there_from_the_look_that_saw_them() -> None:
    timeline = timeline_of(toy_run())
    assert _at(timeline, 3.9) == {"Plate|1": INDEX[TABLE]}, "known at the start"
    assert _at(timeline, 4.0) == {"Plate|1": INDEX[TABLE], "Egg|1": INDEX[FRIDGE]}
    assert set(_at(timeline, 7.0)) == {"Plate|1", "Egg|1", "Mug|1", "Pot|1"}


def test_what_is_in_the_hand_lies_nowhere() -> None:
    assert "Mug|1" not in _at(timeline_of(toy_run()), 12.0)


def test_what_is_put_down_lies_where_it_was_put() -> None:
    put = action(7, 3, "place", 15, 20, BED, item_types=("Mug",), items=("Mug|1",))
    timeline = timeline_of(replace(toy_run(), actions=(*toy_run().actions, put)))
    assert "Mug|1" not in _at(timeline, 19.9)
    assert _at(timeline, 20.0)["Mug|1"] == INDEX[BED]


def test_a_pick_that_was_refused_moves_nothing() -> None:
    ours = toy_run()
    refused = action(5, 3, "pick", 7, 12, COUNTER, item_types=("Mug",), items=("Mug|1",), success=False)
    timeline = timeline_of(replace(ours, actions=(*ours.actions[:4], refused)))
    assert _at(timeline, 15.0)["Mug|1"] == INDEX[COUNTER]


def test_those_of_the_goal_come_first_in_their_container() -> None:
    there = [p for p in items_seen(timeline_of(toy_run()), ns(7)) if p.container == INDEX[COUNTER]]
    assert [(p.item_type, p.wanted) for p in there] == [("Mug", True), ("Pot", False)]


def test_a_moment_of_the_past_is_what_it_was() -> None:
    timeline = timeline_of(toy_run())
    later, earlier = items_seen(timeline, ns(15)), items_seen(timeline, ns(1))
    assert len(later) > len(earlier) == 1
    assert items_seen(timeline, ns(15)) == later
