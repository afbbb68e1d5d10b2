"""Calibration of cost estimates: the nonrandomized probability integral transform (PIT) for discrete costs.

An interval of a discrete forecast cannot hold exactly 90 %: with 60 % at one cost and 40 % at another it holds
60, 40 or 100 %. The standard check of such forecasts is the probability integral transform (PIT). A
true cost y contributes the interval from P(cost < y) to P(cost <= y), with uniform weight; over calibrated forecasts
these intervals average to the uniform distribution on [0, 1], however discrete the costs (Czado, Gneiting and Held,
"Predictive Model Assessment for Count Data", Biometrics 65, 2009: the nonrandomized PIT).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from workbench.arrays import Floats
from workbench.tolerances import NEAR_SAMPLED_COST

PitInterval = tuple[float, float]
"""P(cost < y) and P(cost <= y) of a true cost y, by the drawn worlds."""

MASS = 0.9
BINS = 10
POINTS = 100


def pit_interval(costs: Floats, truth: float) -> PitInterval:
    """The PIT interval of a true cost; of zero length where no drawn world has that cost."""
    return float(np.mean(costs < truth - NEAR_SAMPLED_COST)), float(np.mean(costs <= truth + NEAR_SAMPLED_COST))


def pit_below(interval: PitInterval, u: float) -> float:
    """The conditional distribution function of the PIT: the share of a PIT interval that lies below u."""
    low, high = interval
    if high <= low:
        return float(u >= low)
    return min(max((u - low) / (high - low), 0.0), 1.0)


def share_within(interval: PitInterval) -> float:
    """The share of a PIT interval within the central MASS; its mean over calibrated forecasts is MASS."""
    tail = (1 - MASS) / 2
    low, high = interval
    if high <= low:
        return float(tail <= low <= 1 - tail)
    return pit_below(interval, 1 - tail) - pit_below(interval, tail)


def pit_histogram(intervals: Sequence[PitInterval]) -> tuple[float, ...]:
    """The PIT histogram over equal bins of [0, 1]; every bar is 1 / BINS when calibrated. Empty without intervals.

    A hump means that forecasts are too wide, a U shape too narrow, a slope that they are biased.
    """
    if not intervals:
        return ()
    edges = [i / BINS for i in range(1, BINS)]
    upto = [0.0, *(float(np.mean([pit_below(s, u) for s in intervals])) for u in edges), 1.0]
    return tuple(b - a for a, b in pairwise(upto))


def pit_distance(intervals: Sequence[PitInterval]) -> float | None:
    """The Kolmogorov-Smirnov distance of the mean PIT from the uniform distribution; None without intervals."""
    if not intervals:
        return None
    grid = [i / POINTS for i in range(1, POINTS)]
    return max(abs(float(np.mean([pit_below(s, u) for s in intervals])) - u) for u in grid)
