"""Betting limits: they hold at all times together, never decrease, and come near the mean."""

from __future__ import annotations

import numpy as np
import pytest

from replayers.selection.betting import lower_limits


def test_limits_are_wrong_at_any_time_less_often_than_alpha() -> None:
    rng = np.random.default_rng(0)
    wrong = 0
    for _ in range(200):
        values = rng.choice([-0.5, 0.0, 1.0], p=[0.5, 0.25, 0.25], size=120)  # mean 0
        wrong += bool((lower_limits(values, alpha=0.2) >= 0.005).any())
    assert wrong / 200 <= 0.2


def test_limits_never_decrease_and_come_near_the_mean() -> None:
    limits = lower_limits(np.tile([0.3, 0.5], 400), alpha=0.05)
    assert (np.diff(limits) >= 0).all()
    assert 0.33 < limits[-1] < 0.4
    assert limits[0] == -1


def test_values_that_are_unalike_count_by_their_conditional_means() -> None:
    values = [0.9 if t % 2 else -0.9 for t in range(300)]  # means that alternate; no common mean above 0
    assert lower_limits(values, alpha=0.05)[-1] < 0.0


@pytest.mark.parametrize("values", [[1.5], [float("nan")], [0.0, -1.1]])
def test_values_outside_the_range_are_refused(values: list[float]) -> None:
    with pytest.raises(ValueError, match="outside"):
        lower_limits(values, alpha=0.05)


def test_alpha_is_a_probability() -> None:
    with pytest.raises(ValueError, match="alpha"):
        lower_limits([0.1], alpha=1.0)
