"""How surely a look shows what is there."""

from __future__ import annotations

import pytest

from workbench.errors import BadValue
from workbench.worlds.house import ItemType
from workbench.worlds.perception import PERFECT, Perception, missing_at


def test_a_type_that_is_not_named_is_detected_as_the_others() -> None:
    seen = Perception(p_detect=0.9, by_type={ItemType("Mug"): 0.5})
    assert (seen.of(ItemType("Mug")), seen.of(ItemType("Book"))) == (0.5, 0.9)
    assert not seen.perfect


def test_a_rate_of_zero_is_perfect() -> None:
    assert missing_at(0.0) is PERFECT
    assert PERFECT.perfect
    assert missing_at(0.25).of(ItemType("Mug")) == 0.75


@pytest.mark.parametrize("rate", [-0.1, 1.0, 1.5, float("nan")])
def test_rates_that_are_none_are_refused(rate: float) -> None:
    with pytest.raises(BadValue):
        missing_at(rate)


def test_probabilities_and_sources_that_are_none_are_refused() -> None:
    with pytest.raises(BadValue):
        Perception(p_detect=0.0)
    with pytest.raises(BadValue):
        Perception(by_type={ItemType("Mug"): 1.1})
    with pytest.raises(BadValue):
        Perception(source="guessed")  # type: ignore[arg-type]
