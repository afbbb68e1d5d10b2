"""Betting tests and confidence limits of a mean of bounded values, valid at every time at once.

Each candidate mean m has a capital that grows by 1 + bet (x - m) with every value x, and the bet is fixed before x is
seen. Were the mean at most m, the capital would be a supermartingale, so that it ever reaches 1 / alpha with a
probability of at most alpha (Ville's inequality): a limit may be read off after every trial, and trials stopped
whenever one likes. The values need not be alike: it is enough that the mean of each, given those before it, is at
most m. Source: Waudby-Smith and Ramdas, "Estimating means of bounded random variables by betting", Journal of the
Royal Statistical Society B 86(1), 2024, Sec. 4 (the bets are its approximate GRAPA, Sec. B.3).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import Floats
from workbench.tolerances import DEGENERATE, ROUNDING

MAX_BET = 0.75
"""The share of what a bet could lose at worst."""

PRIOR_VARIANCE = 0.05
"""Variance assumed before the first value, for values in -1..1."""

GRID = np.linspace(-1.0, 1.0, 401)
"""Candidate means; limits are rounded outwards to them."""


def lower_limits(values: ArrayLike, *, alpha: float) -> Floats:
    """After each value, the greatest mean m of the grid such that the true mean is above m; -1 for none.

    Args:
        values: shape (trials,), each in -1..1.
        alpha: the probability that any of the limits, ever, is above the true mean.

    Returns:
        Shape (trials,), never decreasing.

    Raises:
        ValueError: a value outside -1..1, or an alpha outside (0, 1).
    """
    capital = log_capitals(values)
    if not 0 < alpha < 1:
        raise ValueError(f"alpha {alpha} is not between 0 and 1")
    reached = np.maximum.accumulate(capital, axis=0) >= -np.log(alpha)
    below = np.logical_and.accumulate(reached, axis=1)  # rejected together with all smaller means
    highest = below.sum(axis=1)
    return np.where(highest > 0, GRID[np.maximum(highest - 1, 0)], -1.0)


def log_capitals(values: ArrayLike) -> Floats:
    """The logarithm of the capital against each candidate mean of GRID after each value, shape (trials, means)."""
    x = np.asarray(values, dtype=np.float64)
    if np.any(~np.isfinite(x)) or np.any(np.abs(x) > 1 + ROUNDING):
        raise ValueError("values outside -1..1")
    count = np.arange(1, len(x) + 1)
    mean = np.cumsum(x) / (count + 1)
    spread = (PRIOR_VARIANCE + np.cumsum((x - mean) ** 2)) / (count + 1)
    mean, spread = np.concatenate([[0.0], mean])[:-1], np.concatenate([[PRIOR_VARIANCE], spread])[:-1]
    edge = mean[:, None] - GRID[None, :]
    bet = np.clip(edge / (spread[:, None] + edge**2), 0.0, MAX_BET / (1.0 + GRID[None, :] + DEGENERATE))
    return np.cumsum(np.log1p(bet * (x[:, None] - GRID[None, :])), axis=0)
