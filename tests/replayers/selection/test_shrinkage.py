"""Shrinkage: noisy trials count little beside what their starts let expect; priors that are far off are left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from known_costs import NAMES, trial

from replayers.selection.selectors import by_intervals
from replayers.selection.shrinkage import shrunk_means, trials_share
from replayers.selection.trial_costs import PriorCosts, TrialCosts

EVEN = PriorCosts(mean=np.array([40.0, 50.0, 60.0]), variance=400.0)


def seen(*costs: float, prior: PriorCosts | None = EVEN) -> TrialCosts:
    """A trial with open bounds, so that nothing is proved."""
    given = list(costs)
    return replace(trial([0.0] * 3, [99.0] * 3, estimate=given), prior=prior)


def test_without_priors_the_trials_alone_count() -> None:
    means = np.array([3.0, 1.0, 2.0])
    assert np.array_equal(shrunk_means(means, [seen(3, 1, 2, prior=None)]), means)


def test_one_noisy_trial_counts_little() -> None:
    # b cost 20 less than a, but such differences come and go: a is expected to be the cheapest
    trials = [seen(50, 30, 70)]
    assert NAMES[by_intervals(trials, NAMES, np.random.default_rng(0))] == "a"
    without = [replace(t, prior=None) for t in trials]
    assert NAMES[by_intervals(without, NAMES, np.random.default_rng(0))] == "b"


def test_shrinking_moves_differences_and_keeps_the_level() -> None:
    trials = [seen(100, 90, 110)]
    shrunk = shrunk_means(np.array([100.0, 90.0, 110.0]), trials)
    assert shrunk.mean() == pytest.approx(100)
    assert np.ptp(shrunk) == pytest.approx(20, abs=1)


def test_priors_that_many_trials_contradict_are_left() -> None:
    rng = np.random.default_rng(0)
    trials = [seen(*(np.array([60.0, 40.0, 60.0]) + rng.normal(0, 5, size=3))) for _ in range(20)]
    assert NAMES[by_intervals(trials, NAMES, np.random.default_rng(0))] == "b"
    costs, priors = np.array([t.expected for t in trials]), np.tile(EVEN.mean, (20, 1))
    assert (trials_share(costs, priors, EVEN.variance)[:2] > 0.5).all()


def test_one_prior_that_is_wrong_is_left_however_many_are_right() -> None:
    """The last of 20 strategies costs 5 more than the first, and its prior says 5 less."""
    rng = np.random.default_rng(0)
    true = 100 + np.r_[0.0, np.full(19, 5.0)]
    believed = true - np.r_[np.zeros(19), 10.0]
    wrong = 0
    for _ in range(50):
        costs = true + rng.normal(0, 40, (40, 1)) + rng.normal(0, 10, (40, 20))
        priors = believed + rng.normal(0, 3, (40, 20))
        share = trials_share(costs, priors, 100.0)
        expected = priors.mean(axis=0) - priors.mean() + costs.mean()
        wrong += int(np.argmin(share * costs.mean(axis=0) + (1 - share) * expected)) == 19
    assert wrong <= 5


def test_trials_that_always_differ_alike_count_in_full() -> None:
    priors = np.tile(EVEN.mean, (2, 1))
    assert (trials_share(priors + 7, priors, 0.0) == 1.0).all()
    share = trials_share(priors + 7, priors, 400.0)
    assert ((share > 0) & (share < 0.01)).all()


def test_more_trials_count_more() -> None:
    rng = np.random.default_rng(1)
    priors = rng.uniform(50, 150, size=(400, 3))
    costs = priors + rng.normal(0, 15, size=(400, 3))
    shares = [float(trials_share(costs[:n], priors[:n], 150.0).mean()) for n in (1, 20, 400)]
    assert shares == sorted(shares)
    assert shares[-1] < 0.9
