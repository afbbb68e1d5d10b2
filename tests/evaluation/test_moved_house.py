"""Houses in which things have moved: how many, where to, and that nothing is lost."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.errors import BadValue
from workbench.evaluation.moved_house import moved_house
from workbench.worlds.house import House
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.procthor.load import load_house


def where(house: House) -> dict[str, str]:
    return {item.id: c for c, items in house.contents.items() for item in items}


def test_the_share_that_moves_is_what_was_asked_and_nothing_is_lost() -> None:
    house = load_house("houses:0")
    travel = navigate(house.plan).travel
    before = where(house)
    for share in (0.0, 0.25, 1.0):
        after = where(moved_house(house, travel, share, rng=np.random.default_rng(5)))
        assert after.keys() == before.keys()
        assert sum(after[i] != before[i] for i in before) == round(share * len(before))
    again = where(moved_house(house, travel, 0.25, rng=np.random.default_rng(5)))
    assert again == where(moved_house(house, travel, 0.25, rng=np.random.default_rng(5)))
    some = {i for i in before if again[i] != before[i]}
    everything = where(moved_house(house, travel, 1.0, rng=np.random.default_rng(5)))
    assert all(everything[i] != before[i] for i in some), "what moves first is among what moves later"


def test_shares_outside_0_and_1_are_refused() -> None:
    house = load_house("houses:0")
    for share in (-0.1, 1.1, float("nan")):
        with pytest.raises(BadValue):
            moved_house(house, navigate(house.plan).travel, share, rng=np.random.default_rng(0))
