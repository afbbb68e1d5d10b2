"""The codec of events: round trip, the same bytes for the same event, and refusal of unknown messages."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sample_logs import T0, toy_events

from workbench.beliefs.asking.answers import Answer
from workbench.beliefs.belief import Belief
from workbench.execution.events import BeliefUpdated, EstimatorAnswered, FindCostsUpdated, ItemSighted
from workbench.log_schema.codec import UndecodableMessage, UnknownTopic, decode, encode, to_wire
from workbench.log_schema.events import REPEATABLE, TOPIC_OF, TOPICS, BeliefUpdate, Stamp, Timing
from workbench.search.find_costs import FindCosts
from workbench.worlds.geometry import Pose
from workbench.worlds.house import START, ContainerId, Item, ItemId, ItemType, LocationId

NAMES = st.text(min_size=1, max_size=12)


def test_every_event_of_a_run_survives_the_wire():
    asked = Answer(estimator="e@1", model="m", question="where\n?", answer='{"Fridge|1": 1}', seconds=0.123456789)
    sighted = ItemSighted(
        stamp_ns=T0,
        decision=1,
        container=ContainerId("Desk|2"),
        item=Item(id=ItemId("Mug|2"), type=ItemType("Mug")),
        robot_at=START,
        viewpoint=Pose(x_m=1.25, y_m=-2.0, yaw_rad=0.5),
    )
    events = (*toy_events(), sighted, EstimatorAnswered(stamp_ns=T0, decision=1, answer=asked))
    wires = [wire for event in events for wire in to_wire(event)]
    for wire in wires:
        topic = TOPIC_OF[type(wire)]
        assert decode(topic, encode(wire)) == wire
    assert {TOPIC_OF[type(wire)] for wire in wires} == set(TOPICS) - {"/search/truth", "/recorder/dropped"}


def test_a_decision_has_its_wall_clock_seconds_apart_so_that_its_bytes_repeat():
    planned = next(e for e in toy_events() if type(e).__name__ == "PlanMade")
    plan, timing = to_wire(planned)
    assert isinstance(timing, Timing)
    assert timing.planning_s == 0.002
    assert TOPIC_OF[type(plan)] in REPEATABLE
    assert TOPIC_OF[Timing] not in REPEATABLE
    assert b"planning_s" not in encode(plan)


@given(
    types=st.lists(NAMES, min_size=1, max_size=4, unique=True),
    containers=st.lists(NAMES, min_size=0, max_size=5, unique=True),
    data=st.data(),
)
@settings(max_examples=60, deadline=None)
def test_beliefs_round_trip_to_six_decimals(types: list[str], containers: list[str], data: st.DataObject):
    shape = (len(types), len(containers))
    flat = data.draw(st.lists(st.floats(0, 1), min_size=shape[0] * shape[1], max_size=shape[0] * shape[1]))
    p = np.array(flat, dtype=float).reshape(shape)
    belief = Belief(
        item_types=tuple(map(ItemType, types)),
        containers=tuple(map(ContainerId, containers)),
        probability=p,
        estimator="e",
    )
    (wire,) = to_wire(BeliefUpdated(stamp_ns=T0, decision=1, belief=belief))
    again = decode("/search/belief", encode(wire))
    assert isinstance(again, BeliefUpdate)
    assert again == wire
    assert again.item_types == tuple(types)
    assert np.allclose(np.array(again.probability).reshape(shape), p, atol=5e-7, rtol=0)


def test_find_costs_keep_their_axes():
    metres = np.arange(6, dtype=float).reshape(1, 2, 3) + 0.1234567
    origins, targets = (LocationId("a"), LocationId("b")), (LocationId("x"), LocationId("y"), LocationId("z"))
    costs = FindCosts(item_types=(ItemType("Mug"),), origins=origins, targets=targets, metres=metres, kind="model")
    (wire,) = to_wire(FindCostsUpdated(stamp_ns=T0, decision=1, find_costs=costs))
    assert wire.metres[0][1][2] == 5.123457


def test_stamps_keep_every_nanosecond():
    ns = 1_767_225_600_123_456_789
    assert Stamp.of(ns).ns == ns
    assert Stamp.of(ns) == Stamp(1_767_225_600, 123_456_789)


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b"null", b'{"stamp": 3}', b"\xff\xfe", b"[" * 100_000])
def test_bytes_that_are_no_event_are_refused_in_one_line(data: bytes):
    with pytest.raises(UndecodableMessage, match=r"/search/plan cannot be decoded"):
        decode("/search/plan", data)


def test_a_topic_outside_the_vocabulary_is_refused():
    with pytest.raises(UnknownTopic, match="/camera"):
        decode("/camera", b"{}")
