"""Selectors: ours takes the least expected cost; the bandits see the driven costs alone."""

from __future__ import annotations

import numpy as np
import pytest
from known_costs import NAMES, trial

from replayers.selection.selectors import SELECTORS

RNG = 0


def chosen(name: str, trials: list[object]) -> str:
    return NAMES[SELECTORS[name](trials, NAMES, np.random.default_rng(RNG))]  # type: ignore[arg-type]


def test_intervals_take_the_least_expected_cost() -> None:
    assert chosen("intervals", [trial([50, 20, 10], [50, 40, 70], estimate=[50, 25, 45])]) == "b"


def test_intervals_never_drive_what_is_out_by_proof() -> None:
    apart = np.array([[0.0, -1.0, 5.0], [9.0, 0.0, 9.0], [9.0, 9.0, 0.0]])
    trials = [trial([30, 20, 50], [60, 60, 60], estimate=[40, 25, 55], max_difference=apart)]
    assert chosen("intervals", trials) == "a"  # b is expected to be cheaper, and costs more than a in every world


def test_an_estimate_counts_within_its_bounds_only() -> None:
    assert chosen("intervals", [trial([50, 45, 60], [50, 48, 90], estimate=[50, 99, 60])]) == "b"


def test_lower_bounds_are_taken_for_costs() -> None:
    assert chosen("lower-bounds", [trial([50, 20, 10], [50, 20, 90])] * 3) == "c"


@pytest.mark.parametrize("name", ["ucb1", "thompson"])
def test_bandits_try_every_strategy_first(name: str) -> None:
    seen = [trial([90, 1, 1], [90, 1, 1], driven="a"), trial([1, 80, 1], [1, 80, 1], driven="b")]
    assert chosen(name, seen) == "c"


@pytest.mark.parametrize("name", sorted(SELECTORS))
def test_any_selector_starts_somewhere(name: str) -> None:
    assert chosen(name, []) in NAMES
