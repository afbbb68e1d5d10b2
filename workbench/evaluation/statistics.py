"""Cluster-bootstrap intervals of means and of paired differences over trials.

Trials in one house share its map and its contents, so they are not independent: the bootstrap draws houses with
replacement and takes all trials of each (Davison and Hinkley 1997, Sec. 3.8; percentile interval).

A single cluster says nothing of how clusters vary. Its interval draws its own trials instead, says so (`resampled`),
and is widened. So is the interval of few clusters (up to MAX_WIDENED_CLUSTERS). n of them spread too little by
sqrt((n - 1) / n), and their spread is itself estimated, for which Student's t stands (Hesterberg 2015, The American
Statistician 69(4), on why percentile intervals of few draws are narrow). A widened interval covers both the
percentile interval, with its ends moved outward by these two factors, and Student's t interval, which is exact for
normal values. One single trial has no interval.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from math import isfinite
from statistics import NormalDist

import numpy as np
import numpy.typing as npt

from workbench.arrays import Floats
from workbench.errors import BadValue
from workbench.evaluation.distributions import student_quantile

DRAWS = 4000
_DRAWS_PER_BLOCK = 500

MAX_WIDENED_CLUSTERS = 15
"""Up to so many clusters, their interval is widened: a plain percentile interval covers 0.73 (3) to 0.91 (15)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IntervalEstimate:
    """A number with its interval.

    Attributes:
        value: the mean or ratio over all trials.
        lower, upper: the ends of the interval; NaN where there is one trial only.
        level: its coverage, 0.95 for "95 %".
        trials, clusters: how many there were.
    """

    value: float
    lower: float
    upper: float
    level: float
    trials: int
    clusters: int

    @property
    def interval(self) -> tuple[float, float]:
        return (self.lower, self.upper)

    def resampled(self, cluster: str = "houses", trial: str = "trials") -> str:
        """What the interval drew, in words: as the function of that name."""
        return resampled(self.trials, self.clusters, cluster, trial)


def mean_with_interval(
    values: npt.ArrayLike,
    clusters: Sequence[Hashable],
    *,
    rng: np.random.Generator,
    level: float = 0.95,
    draws: int = DRAWS,
) -> IntervalEstimate:
    """The mean of the values, with equal weight per trial.

    Args:
        values: shape (trials,).
        clusters: the house (or other cluster) of each trial.

    Raises:
        BadValue: there is no trial, lengths differ, a value is not finite, or the level is outside (0, 1).
    """
    measured = np.asarray(values, dtype=np.float64)
    return ratio_with_interval(measured, np.ones_like(measured), clusters, rng=rng, level=level, draws=draws)


def paired_difference(
    a: npt.ArrayLike,
    b: npt.ArrayLike,
    clusters: Sequence[Hashable],
    *,
    rng: np.random.Generator,
    level: float = 0.95,
    draws: int = DRAWS,
) -> IntervalEstimate:
    """The mean of a - b over paired trials, which removes the variance between trials.

    Args and Raises: as for mean_with_interval; a and b have the same length.
    """
    first, second = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    if first.shape != second.shape:
        raise BadValue("paired values", (first.shape, second.shape), "of one length")
    return mean_with_interval(first - second, clusters, rng=rng, level=level, draws=draws)


def ratio_with_interval(
    numerator: npt.ArrayLike,
    denominator: npt.ArrayLike,
    clusters: Sequence[Hashable],
    *,
    rng: np.random.Generator,
    level: float = 0.95,
    draws: int = DRAWS,
) -> IntervalEstimate:
    """Sum of the numerator over sum of the denominator: for shares of Greedy's cost or of the gap to the oracle.

    Args:
        numerator, denominator: shape (trials,).
        clusters: the house of each trial.

    Raises:
        BadValue: as mean_with_interval.
    """
    top, bottom = np.asarray(numerator, dtype=np.float64), np.asarray(denominator, dtype=np.float64)
    _check(top, bottom, clusters, level)
    tops, bottoms = _sums(top, bottom, clusters)
    drawn = _drawn_ratios(tops, bottoms, rng, draws)
    value = _ratio(float(top.sum()), float(bottom.sum()))
    lower, upper = interval_of(drawn, value, trials=len(top), clusters=len(set(clusters)), level=level)
    return IntervalEstimate(
        value=value,
        lower=lower,
        upper=upper,
        level=level,
        trials=len(top),
        clusters=len(set(clusters)),
    )


def interval_of(
    drawn: npt.ArrayLike, value: float, *, trials: int, clusters: int, level: float = 0.95
) -> tuple[float, float]:
    """The percentile interval of what was drawn; widened for few clusters, or where trials of one cluster were drawn.

    Args:
        drawn: shape (draws,); of clusters, or of the trials of the only one.
        value: what was measured.
    """
    measured = np.asarray(drawn, dtype=np.float64)
    if not len(measured):
        return (float("nan"), float("nan"))
    tail = (1 - level) / 2
    lower, upper = (float(end) for end in np.quantile(measured, [tail, 1 - tail]))
    if clusters > MAX_WIDENED_CLUSTERS:
        return (lower, upper)
    wider, student = _widening(trials if clusters == 1 else clusters, level)
    half = student * float(measured.std())
    return (
        min(value + wider * (lower - value), value - half),
        max(value + wider * (upper - value), value + half),
    )


def resampled(trials: int, clusters: int, cluster: str = "houses", trial: str = "trials") -> str:
    """What an interval drew: clusters, so that it generalises to others like them; or the trials of the only cluster.

    Args:
        cluster, trial: what these are, in the plural.
    """
    if trials <= 1:
        return "nothing"
    return cluster if clusters > 1 else f"{trial} of one {cluster.removesuffix('s')}"


def intervals_in_words(drew: Iterable[str], *, level: float = 0.95) -> str:
    """What the intervals of a table draw, as a line below it; empty where it has none.

    Args:
        drew: of each interval, as `resampled` names it.
    """
    kinds = [kind for kind in dict.fromkeys(drew) if kind]
    if not kinds:
        return ""
    shown = " or ".join(kind for kind in kinds if kind != "nothing")
    words = f"{100 * level:.0f} % intervals resample {shown}" if shown else "a single trial has no interval"
    alone = [kind.rpartition(" of one ")[2] for kind in kinds if " of one " in kind]
    return words + (f", widened for their number: they say nothing of another {alone[0]}" if alone else "")


def ends_in_words(ends: Sequence[float | None], form: str = ".1f", *, scale: float = 1.0) -> str:
    """An interval as text, "1.0 to 2.0"; "no interval" where there was a single trial."""
    shown = [end for end in ends if end is not None and isfinite(end)]
    return " to ".join(format(scale * end, form) for end in shown) if len(shown) == len(ends) else "no interval"


def _check(top: Floats, bottom: Floats, clusters: Sequence[Hashable], level: float) -> None:
    if top.ndim != 1 or top.shape != bottom.shape or len(clusters) != len(top):
        raise BadValue("trials", (top.shape, bottom.shape, len(clusters)), "one value and one cluster a trial")
    if len(top) == 0:
        raise BadValue("trials", 0, "at least 1")
    if not (np.isfinite(top).all() and np.isfinite(bottom).all()):
        raise BadValue("trials", "a value that is not finite", "finite")
    if not 0 < level < 1:
        raise BadValue("level", level, "between 0 and 1")


def _sums(top: Floats, bottom: Floats, clusters: Sequence[Hashable]) -> tuple[Floats, Floats]:
    """Sums by cluster in order of first appearance; the trials themselves if there is only one cluster."""
    numbers = {name: i for i, name in enumerate(dict.fromkeys(clusters))}
    if len(numbers) == 1:
        return top, bottom
    of = np.array([numbers[name] for name in clusters])
    tops, bottoms = np.zeros(len(numbers)), np.zeros(len(numbers))
    np.add.at(tops, of, top)
    np.add.at(bottoms, of, bottom)
    return tops, bottoms


def _drawn_ratios(tops: Floats, bottoms: Floats, rng: np.random.Generator, draws: int) -> Floats:
    n, ratios = len(tops), list[Floats]()
    for start in range(0, draws, _DRAWS_PER_BLOCK):
        chosen = rng.integers(n, size=(min(_DRAWS_PER_BLOCK, draws - start), n))
        below = bottoms[chosen].sum(axis=1)
        above = tops[chosen].sum(axis=1)
        ratios.append((above[below != 0] / below[below != 0]).astype(np.float64))
    return np.concatenate(ratios)


def _widening(number: int, level: float) -> tuple[float, float]:
    """Factors for drawn means of so few: of their deviations at the ends, and of their standard deviation.

    NaN for a single one.
    """
    if number == 1:
        return (float("nan"), float("nan"))
    normal, student = NormalDist().inv_cdf((1 + level) / 2), student_quantile((1 + level) / 2, number - 1)
    spread = float(np.sqrt(number / (number - 1)))
    return student / normal * spread, student * spread


def _ratio(top: float, bottom: float) -> float:
    return top / bottom if bottom else float("nan")
