"""Rates of moving learned from looks: by hand, and on a household that is drawn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from workbench.beliefs.memory.fit_rates import PRIOR_MOVES, RevisitInterval, fit_pace, fit_rates
from workbench.beliefs.memory.move_rates import OTHERS, MoveRates
from workbench.worlds.house import ItemType

MUG, BOOK = ItemType("Mug"), ItemType("Book")
KNOWN = MoveRates(others=0.2, by_type={MUG: 0.4, BOOK: 0.1})


def test_nothing_seen_twice_leaves_the_known_rates() -> None:
    assert fit_pace((), KNOWN) == 1.0
    assert fit_pace((RevisitInterval(item_type=MUG, days=0.0, stayed=False),), KNOWN) == 1.0
    rows = {row.item_type: row.rate for row in fit_rates((), KNOWN)}
    assert rows == {OTHERS: 0.2, MUG: 0.4, BOOK: 0.1}


def test_things_that_stay_slow_the_pace_as_worked_out_by_hand() -> None:
    stayed = [RevisitInterval(item_type=BOOK, days=10.0, stayed=True)] * 6
    # prior_moves (1 - r) - r x 6 x 0.1 x 10 = 0
    assert fit_pace(stayed, KNOWN) == pytest.approx(PRIOR_MOVES / (PRIOR_MOVES + 6.0), rel=1e-9)


def test_the_pace_of_a_drawn_household_is_found() -> None:
    rng = np.random.default_rng(3)
    seen: list[RevisitInterval] = []
    for _ in range(3000):
        item_type, days = (MUG, BOOK)[int(rng.integers(2))], float(rng.uniform(0.2, 3.0))
        stays = math.exp(-2.5 * KNOWN.of(item_type) * days)
        seen.append(RevisitInterval(item_type=item_type, days=days, stayed=bool(rng.random() < stays)))
    assert fit_pace(seen, KNOWN) == pytest.approx(2.5, rel=0.06)
    rates = {row.item_type: row.rate for row in fit_rates(seen, KNOWN)}
    assert rates[MUG] == pytest.approx(1.0, rel=0.1)
    assert rates[BOOK] == pytest.approx(0.25, rel=0.1)
    assert rates[OTHERS] == pytest.approx(0.5, rel=0.1)
