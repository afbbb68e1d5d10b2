"""Bootstrap intervals: values solvable by hand, coverage, and the effect of clusters."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.errors import BadValue
from workbench.evaluation.statistics import (
    ends_in_words,
    intervals_in_words,
    mean_with_interval,
    paired_difference,
    ratio_with_interval,
)


def rng() -> np.random.Generator:
    return np.random.default_rng(7)


def test_equal_values_have_no_width() -> None:
    estimate = mean_with_interval([3.0, 3.0, 3.0], ["a", "b", "c"], rng=rng())
    assert (estimate.value, estimate.interval, estimate.trials, estimate.clusters) == (3.0, (3.0, 3.0), 3, 3)


def test_the_mean_weighs_every_trial_the_same_and_not_every_cluster() -> None:
    assert mean_with_interval([1.0, 1.0, 1.0, 5.0], ["a", "a", "a", "b"], rng=rng()).value == 2.0


def test_trials_that_repeat_their_house_do_not_narrow_the_interval() -> None:
    houses = np.random.default_rng(1).normal(size=40)
    once = mean_with_interval(houses, range(40), rng=rng())
    tenfold = mean_with_interval(np.repeat(houses, 10), np.repeat(np.arange(40), 10).tolist(), rng=rng())
    assert tenfold.upper - tenfold.lower == pytest.approx(once.upper - once.lower, rel=1e-9)


def test_the_interval_covers_the_truth_about_as_often_as_it_says() -> None:
    draw = np.random.default_rng(2)
    inside = 0
    for _ in range(200):
        values = draw.normal(size=60)
        estimate = mean_with_interval(values, range(60), rng=draw, draws=500)
        inside += estimate.lower <= 0 <= estimate.upper
    assert 0.89 <= inside / 200 <= 0.99


def test_pairing_takes_out_what_trials_share() -> None:
    hard = np.random.default_rng(3).normal(scale=100, size=50)
    difference = paired_difference(hard + 2.0, hard, range(50), rng=rng())
    assert difference.interval == pytest.approx((2.0, 2.0))


def test_a_ratio_is_of_sums() -> None:
    estimate = ratio_with_interval([1.0, 8.0], [10.0, 10.0], ["a", "b"], rng=rng())
    assert estimate.value == pytest.approx(0.45)
    assert estimate.interval == pytest.approx((0.1, 0.8))


def test_one_cluster_draws_over_its_trials() -> None:
    estimate = mean_with_interval([0.0, 1.0] * 50, ["a"] * 100, rng=rng())
    assert 0.35 < estimate.lower < 0.45 < 0.55 < estimate.upper < 0.65


def test_what_is_drawn_is_said() -> None:
    many = mean_with_interval([1.0, 2.0, 3.0], ["a", "a", "b"], rng=rng())
    one = mean_with_interval([1.0, 2.0, 3.0], ["a", "a", "a"], rng=rng())
    single = mean_with_interval([1.0], ["a"], rng=rng())
    drew = [estimate.resampled("houses", "logs") for estimate in (many, one, single)]
    assert drew == ["houses", "logs of one house", "nothing"]
    assert intervals_in_words(drew[:1]) == "95 % intervals draw houses"
    assert intervals_in_words(drew[1:2]) == (
        "95 % intervals draw logs of one house, widened for their number: they say nothing of another house"
    )
    assert intervals_in_words(drew[2:]) == "a single trial has no interval"
    assert intervals_in_words([]) == ""


def test_a_single_trial_has_no_interval_rather_than_one_of_no_width() -> None:
    estimate = mean_with_interval([7.0], ["a"], rng=rng())
    assert estimate.value == 7.0
    assert np.isnan(estimate.interval).all()
    assert ends_in_words(estimate.interval) == ends_in_words([None, 1.0]) == "no interval"
    assert ends_in_words([0.1, 0.25], "+.1f", scale=100) == "+10.0 to +25.0"


def test_few_trials_of_one_cluster_cover_the_truth_about_as_often_as_said() -> None:
    """Nine times in ten with five normal values: closer than the plain percentile interval, which is too narrow."""
    draw = np.random.default_rng(5)
    inside = 0
    for _ in range(400):
        estimate = mean_with_interval(draw.normal(size=5), ["a"] * 5, rng=draw, draws=500)
        inside += estimate.lower <= 0 <= estimate.upper
    assert 0.87 <= inside / 400 <= 0.99


def test_several_clusters_are_not_widened() -> None:
    """By hand: two clusters, four equally likely draws with means 0.1, 0.45, 0.45 and 0.8."""
    estimate = ratio_with_interval([1.0, 8.0], [10.0, 10.0], ["a", "b"], rng=rng())
    assert estimate.interval == pytest.approx((0.1, 0.8))


def test_the_same_seed_gives_the_same_interval() -> None:
    values = np.arange(20.0)
    assert mean_with_interval(values, range(20), rng=rng()) == mean_with_interval(values, range(20), rng=rng())


@pytest.mark.parametrize(
    ("values", "clusters", "level"),
    [([], [], 0.95), ([1.0], ["a", "b"], 0.95), ([float("nan")], ["a"], 0.95), ([1.0], ["a"], 1.0)],
)
def test_bad_trials_are_refused(values: list[float], clusters: list[str], level: float) -> None:
    with pytest.raises(BadValue):
        mean_with_interval(values, clusters, rng=rng(), level=level)


def test_pairs_of_different_length_are_refused() -> None:
    with pytest.raises(BadValue, match="one length"):
        paired_difference([1.0, 2.0], [1.0], ["a", "b"], rng=rng())
