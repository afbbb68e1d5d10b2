"""Beliefs and cost tables whose shapes do not match their labels are refused when they are read, not when used."""

from __future__ import annotations

import msgspec
import pytest

from workbench.log_schema.codec import UndecodableMessage, decode
from workbench.log_schema.events import BeliefUpdate, FindCosts, Stamp

BELIEF = BeliefUpdate(
    stamp=Stamp.of(1),
    decision=1,
    item_types=("Mug", "Egg"),
    containers=("Fridge|1",),
    probability=((0.25,), (0.5,)),
    estimator="hand@0",
)
COSTS = FindCosts(
    stamp=Stamp.of(1),
    decision=1,
    item_types=("Mug",),
    origins=("start",),
    targets=("start", "Desk|1"),
    metres=(((3.0, 4.0),),),
    kind="model",
    belief_model="exists",
)


@pytest.mark.parametrize(
    ("topic", "event", "fits", "not_fits"),
    [
        ("/search/belief", BELIEF, b"[0.25]", b"[0.25,0.5]"),
        ("/search/belief", BELIEF, b"[[0.25],[0.5]]", b"[[0.25]]"),
        ("/search/find_cost", COSTS, b"[[[3.0,4.0]]]", b"[[[3.0]]]"),
        ("/search/find_cost", COSTS, b"[[[3.0,4.0]]]", b"[[]]"),
        ("/search/find_cost", COSTS, b"[[[3.0,4.0]]]", b"[]"),
    ],
)
def test_numbers_that_do_not_fit_their_labels(
    topic: str, event: msgspec.Struct, fits: bytes, not_fits: bytes
) -> None:
    data = msgspec.json.encode(event)
    assert decode(topic, data) == event
    assert fits in data
    with pytest.raises(UndecodableMessage, match="is not of"):
        decode(topic, data.replace(fits, not_fits))
