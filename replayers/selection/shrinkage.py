"""Mean costs of coming trials: what the trials so far showed, shrunk towards what their starts let expect.

Strategies differ by a few per cent while tasks differ by far more, so after some tens of trials the mean differences
are mostly noise. Worlds drawn at the start of each trial (prior_costs.py) give the same means almost without that
noise, but with an error of their own: the beliefs are not the truth. Both are weighed by their variances, as by Efron
and Morris ("Stein's estimation rule and its competitors", Journal of the American Statistical Association 68, 1973):
the error of a strategy's prior is taken to be PRIOR_ERROR of the mean cost, and more where its trials differ from it
by more than STANDARD_ERRORS, so that a prior that is far off is soon left behind, however many others are right.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from replayers.selection.trial_costs import TrialCosts
from workbench.arrays import Floats

PRIOR_ERROR = 0.01
"""The standard error of a strategy's prior mean against the others', as a share of the mean cost: the least regret of
0.01, 0.015, 0.02 and 0.03 on the training houses, with beliefs of the other half of them."""

STANDARD_ERRORS = 2.0
"""A greater difference between trials and priors counts as an error of the priors."""

PRIOR_TRIALS = 10
"""As many trials count for the variance that the drawn worlds have, beside that of the trials themselves."""


def shrunk_means(means: Floats, trials: Sequence[TrialCosts]) -> Floats:
    """Means over the trials so far, with their differences shrunk; as they are where no trial has priors. Shape (K,).

    Args:
        means: what the trials so far showed, shape (K,).
    """
    with_priors = [(t.expected, t.prior) for t in trials if t.prior is not None]
    if not with_priors:
        return means
    costs, prior = np.array([expected for expected, _ in with_priors]), np.array([p.mean for _, p in with_priors])
    share = trials_share(costs, prior, float(np.mean([p.variance for _, p in with_priors])))
    expected = prior.mean(axis=0)
    return share * means + (1 - share) * (expected - expected.mean() + means.mean())


def trials_share(costs: Floats, priors: Floats, drawn_variance: float) -> Floats:
    """How much the trials count beside their priors for each strategy, in 0..1, shape (K,).

    Args:
        costs, priors: expected costs and prior means of the same trials, shape (trials, K).
        drawn_variance: of the costs against the others' over the drawn worlds of a trial (PriorCosts.variance).
    """
    count = len(costs)
    apart = costs - priors
    apart = apart - apart.mean(axis=1, keepdims=True)
    error = apart.mean(axis=0)
    within = ((apart - error) ** 2).sum(axis=0)
    noise = (PRIOR_TRIALS * drawn_variance + within) / (PRIOR_TRIALS + count - 1) / count
    prior_noise = np.maximum((PRIOR_ERROR * float(priors.mean())) ** 2, error**2 - STANDARD_ERRORS**2 * noise)
    both = prior_noise + noise
    return np.divide(prior_noise, both, out=np.ones_like(both), where=both > 0)
