"""Bootstrap intervals: values solvable by hand, coverage, and the effect of clusters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from workbench.errors import BadValue
from workbench.evaluation.statistics import (
    MAX_WIDENED_CLUSTERS,
    ends_in_words,
    intervals_in_words,
    mean_with_interval,
    paired_difference,
    ratio_with_interval,
)

SLOW = pytest.mark.slow


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


def test_one_cluster_draws_over_its_trials() -> None:
    estimate = mean_with_interval([0.0, 1.0] * 50, ["a"] * 100, rng=rng())
    assert 0.35 < estimate.lower < 0.45 < 0.55 < estimate.upper < 0.65


def test_what_is_drawn_is_said() -> None:
    many = mean_with_interval([1.0, 2.0, 3.0], ["a", "a", "b"], rng=rng())
    one = mean_with_interval([1.0, 2.0, 3.0], ["a", "a", "a"], rng=rng())
    single = mean_with_interval([1.0], ["a"], rng=rng())
    drew = [estimate.resampled("houses", "logs") for estimate in (many, one, single)]
    assert drew == ["houses", "logs of one house", "nothing"]
    assert intervals_in_words(drew[:1]) == "95 % intervals resample houses"
    assert intervals_in_words(drew[1:2]) == (
        "95 % intervals resample logs of one house, widened for their number: they say nothing of another house"
    )
    assert intervals_in_words(drew[2:]) == "a single trial has no interval"
    assert intervals_in_words([]) == ""


def test_a_single_trial_has_no_interval_rather_than_one_of_no_width() -> None:
    estimate = mean_with_interval([7.0], ["a"], rng=rng())
    assert estimate.value == 7.0
    assert np.isnan(estimate.interval).all()
    assert ends_in_words(estimate.interval) == ends_in_words([None, 1.0]) == "no interval"
    assert ends_in_words([0.1, 0.25], "+.1f", scale=100) == "+10.0 to +25.0"


def coverage(draw: Callable[[np.random.Generator, int], np.ndarray], truth: float, number: int, one: bool) -> float:
    """How often of 1,500 times the interval of so few holds the truth; trials of one cluster, or one trial each."""
    rng_, inside = np.random.default_rng(5), 0
    for _ in range(1500):
        clusters = ["a"] * number if one else range(number)
        estimate = mean_with_interval(draw(rng_, number), clusters, rng=rng_, draws=300)
        inside += estimate.lower <= truth <= estimate.upper
    return inside / 1500


@pytest.mark.ci_but(2)
@pytest.mark.parametrize("one", [True, False])
@pytest.mark.parametrize("number", [3, 5, pytest.param(4, marks=SLOW), pytest.param(7, marks=SLOW), 10])
def test_few_cover_the_truth_at_least_as_often_as_said(number: int, one: bool) -> None:
    """Normal values: 0.95, less 2.3 standard errors of 1,500 tries. Plain percentile intervals: 0.73 to 0.90."""
    assert 0.937 <= coverage(lambda rng_, n: rng_.normal(size=n), 0.0, number, one) <= 0.975


@pytest.mark.parametrize("number", [3, 10])
def test_few_skewed_values_are_covered_nearly_as_often(number: int) -> None:
    """Exponential values: Student's t covers 0.88 of three, a plain percentile interval 0.69."""
    assert coverage(lambda rng_, n: rng_.exponential(size=n), 1.0, number, True) >= 0.87


def test_few_clusters_have_at_least_students_interval() -> None:
    """By hand: houses at 0.1 and 0.8 have the mean 0.45, standard error 0.35 and t = 12.706."""
    estimate = ratio_with_interval([1.0, 8.0], [10.0, 10.0], ["a", "b"], rng=rng(), draws=100_000)
    assert estimate.interval == pytest.approx((0.45 - 12.706 * 0.35, 0.45 + 12.706 * 0.35), rel=0.01)


def test_many_clusters_are_not_widened() -> None:
    """The percentile interval of drawn means, by hand from the same draws."""
    values = np.arange(float(MAX_WIDENED_CLUSTERS + 1))
    chosen = rng().integers(len(values), size=(500, len(values)))
    by_hand = np.quantile(values[chosen].mean(axis=1), [0.025, 0.975])
    assert mean_with_interval(
        values, range(MAX_WIDENED_CLUSTERS + 1), rng=rng(), draws=500
    ).interval == pytest.approx(tuple(by_hand))


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
