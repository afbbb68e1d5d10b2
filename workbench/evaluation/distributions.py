"""Quantiles of the beta distribution and of Student's t, from the regularized incomplete beta function.

The function is the continued fraction of Abramowitz and Stegun 26.5.8, evaluated by Lentz's method as in Numerical
Recipes, 6.4 (Press et al.); the quantile is found by bisection. They are within 1e-9 of scipy.special's, to which a
test holds them.
"""

from __future__ import annotations

from math import exp, lgamma, log, log1p, sqrt

from workbench.tolerances import FRACTION_ACCURACY, SMALLEST

MAX_TERMS = 10_000


def beta_quantile(p: float, a: float, b: float) -> float:
    """Where the cumulative beta distribution reaches p.

    Args:
        p: from 0 to 1.
        a: the first shape, above 0.
        b: the second shape, above 0.
    """
    low, high = 0.0, 1.0
    while low < (middle := (low + high) / 2) < high:
        low, high = (middle, high) if beta_cdf(middle, a, b) < p else (low, middle)
    return high


def student_quantile(p: float, degrees: float) -> float:
    """Where the cumulative distribution of Student's t reaches p, from 0.5 to below 1."""
    x = beta_quantile(2 * (1 - p), degrees / 2, 0.5)
    return sqrt(degrees * (1 - x) / x)


def beta_cdf(x: float, a: float, b: float) -> float:
    """The regularized incomplete beta function I_x(a, b), x from 0 to 1."""
    if x <= 0 or x >= 1:
        return min(1.0, max(0.0, x))
    if x > (a + 1) / (a + b + 2):
        return 1 - beta_cdf(1 - x, b, a)
    factor = exp(lgamma(a + b) - lgamma(a) - lgamma(b) + a * log(x) + b * log1p(-x))
    return factor / a / _continued_fraction(x, a, b)


def _continued_fraction(x: float, a: float, b: float) -> float:
    """1 + d1/(1 + d2/(1 + ...)) by Lentz's method."""
    value, above, below = 1.0, 1.0, 0.0
    for term in range(1, MAX_TERMS):
        m = term // 2
        if term % 2:
            d = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        else:
            d = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        below = 1 / (1 + d * below or SMALLEST)
        above = 1 + d / above or SMALLEST
        value *= above * below
        if abs(above * below - 1) < FRACTION_ACCURACY:
            break
    return value
